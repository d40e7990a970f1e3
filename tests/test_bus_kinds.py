"""Promises of every kind of servo bus, over both twins: the suite that packages run on theirs."""

import pytest
from bus_kinds import KINDS, ON_EITHER, in_process, twin_of

from gazerig.testing import BusLossSuite, BusSuite


class TestEveryKind(BusSuite):
    @pytest.fixture(params=ON_EITHER, ids="-".join)
    def twin(self, request):
        with twin_of(*request.param) as made:
            yield made

    @pytest.fixture(params=KINDS)
    def another(self, request):
        return lambda: in_process(request.param)


# Every kind of servo bus without a servo, a port or a supply, over both twins


class TestEveryKindOfLoss(BusLossSuite):
    @pytest.fixture(params=ON_EITHER, ids="-".join)
    def twin(self, request):
        with twin_of(*request.param) as made:
            yield made

    @pytest.fixture(params=KINDS)
    def another(self, request):
        return lambda: in_process(request.param)
