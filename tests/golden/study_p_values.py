"""What pingouin says of 20 data sets with ties: python tests/golden/study_p_values.py writes it.

It needs pingouin, which drags in 390 MB and is therefore no dependency of the tests.
"""

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np

FILE = Path(__file__).with_name("study_p_values.json")
SETS = 20


def data_sets() -> list[np.ndarray]:
    """Return ratings of 1 to 5, (participants, 3 conditions): many ties, some zeros, few people."""
    rng = np.random.default_rng(20261123)
    sets = []
    for k in range(SETS):
        people = int(rng.integers(7, 41))
        own = rng.normal(0.0, 0.8, people)[:, None]
        latent = own + rng.normal(0.0, 1.0, (people, 3)) + np.array([0.0, 0.1 * (k % 8), 0.3])
        sets.append(1 + np.digitize(latent, [-1.0, -0.3, 0.3, 1.0]))
    return sets


def p_values(rows: np.ndarray) -> dict[str, float]:
    """Return pingouin's p of each test on one data set, and its alpha and effects."""
    import pandas as pd
    import pingouin as pg

    a, b = rows[:, 0].astype(float), rows[:, 1].astype(float)
    out: dict[str, float] = {}

    def one(table: Any, column: str) -> float:
        return float(table[column].iloc[0])

    for zeros in ("wilcox", "pratt"):
        for side in ("two-sided", "greater"):
            found = pg.wilcoxon(
                b, a, alternative=side, zero_method=zeros, correction=True, method="asymptotic"
            )
            out[f"signed_rank {zeros} {side}"] = one(found, "p_val")
    out["matched correlation"] = one(pg.wilcoxon(b, a), "RBC")
    for side in ("two-sided", "greater"):
        found = pg.mwu(b, a, alternative=side, method="asymptotic")
        out[f"rank_sum {side}"] = one(found, "p_val")
    out["dominance"] = one(pg.mwu(b, a), "RBC")
    out["friedman"] = one(pg.friedman(pd.DataFrame(rows)), "p_unc")
    out["concordance"] = one(pg.friedman(pd.DataFrame(rows)), "W")
    long = pd.DataFrame(
        {"condition": np.repeat(["a", "b"], len(a)), "rating": np.concatenate([a, b])}
    )
    with warnings.catch_warnings():
        # It warns of small counts, and divides by them in statistics that are not asked for.
        warnings.simplefilter("ignore")
        _, _, tests = pg.chi2_independence(long, "condition", "rating", correction=False)
    pearson = tests[tests["test"] == "pearson"]
    out["chi_square"], out["cramers_v"] = one(pearson, "pval"), one(pearson, "cramer")
    out["cronbachs_alpha"] = float(pg.cronbach_alpha(pd.DataFrame(rows))[0])
    return out


def main() -> None:
    """Write the file."""
    sets = data_sets()
    found = [{"ratings": s.tolist(), "pingouin": p_values(s)} for s in sets]
    families = [[f["pingouin"][k] for f in found] for k in ("rank_sum two-sided", "chi_square")]
    import pingouin as pg

    corrected = {
        by: [pg.multicomp(family, method=by)[1].tolist() for family in families]
        for by in ("holm", "bonf")
    }
    FILE.write_text(json.dumps({"sets": found, "corrected": corrected}, indent=None) + "\n")
    print(f"{FILE}: {len(found)} data sets, pingouin {pg.__version__}")


if __name__ == "__main__":
    main()
