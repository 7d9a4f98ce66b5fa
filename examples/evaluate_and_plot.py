"""Evaluate a mission on random layouts, and plot how far off their centres frames were crossed."""

import sys

from matplotlib import pyplot

import framerunner

if __name__ == "__main__":
    count, picture = int(sys.argv[1]), sys.argv[2]
    evaluation = framerunner.evaluate(level="calm", count=count)
    print(f"landed: {evaluation.summary.landed}")
    for row in evaluation.rows:
        offsets_cm = [100 * offset_m for offset_m in row.crossing_offsets_m]
        pyplot.scatter(row.frames_crossed, offsets_cm, label=f"{row.scenario}: {row.verdict}")
    pyplot.ylabel("off the centre (cm)")
    pyplot.legend()
    pyplot.savefig(picture)
