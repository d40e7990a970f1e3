"""Range and errors of perception: python tests/bench/bench_seeing.py [--rows 1 3] [--full]

Measures every row of tests/seeing (range, motion of the camera, faces, who looks at the head) and
prints what is wanted, what was measured, and whether it is inside; with --against a file that
--save wrote, also what it was before. Nothing here passes or fails. With --full also on films and
photos of others where they are at hand. bench_seeing_cost.py measures what seeing costs a tick.
"""

from measured_rows import arguments, measure_all


def main() -> None:
    """Measure and print."""
    parser = arguments(__doc__)
    parser.add_argument("--full", action="store_true", help="all material and seeds there are")
    args = parser.parse_args()
    print(f"\n{measure_all('seeing', args, parser, lambda row: row.measure(args.full))}")


if __name__ == "__main__":
    main()
