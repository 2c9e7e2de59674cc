"""Divides a METIS graph file (without weights) by KaFFPa-strong of KaHIP.

    kaffpa.py GRAPH PARTS IMBALANCE SEED

Prints the part of each vertex, one a line, after one line of JSON: CPU seconds.
"""

import json
import sys
import time

import kahip


def read(path):
    with open(path, encoding="ascii") as file:
        lines = [line for line in file if not line.startswith("%")]
    offsets, neighbours = [0], []
    for line in lines[1:]:
        neighbours.extend(int(word) - 1 for word in line.split())
        offsets.append(len(neighbours))
    return offsets, neighbours


def main():
    path, parts, imbalance, seed = sys.argv[1:]
    offsets, neighbours = read(path)
    ones = [1] * (len(offsets) - 1), [1] * len(neighbours)
    begun = time.process_time()
    _, part_of = kahip.kaffpa(
        ones[0], offsets, ones[1], neighbours, int(parts), float(imbalance), True, int(seed), kahip.STRONG
    )
    print(json.dumps({"cpu": time.process_time() - begun}))
    print("\n".join(map(str, part_of)))


if __name__ == "__main__":
    main()
