"""Fly a mission on a random layout, in lockstep, and read the result."""

import framerunner

result = framerunner.fly("calm-17")
print(result.verdict, f"after {result.try_time_s:.1f} s")
for colour, offset_m in zip(result.frames_crossed, result.crossing_offsets_m, strict=True):
    print(f"crossed the {colour} frame {100 * offset_m:.1f} cm off its centre")
