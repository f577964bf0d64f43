#!/usr/bin/env python3
"""Reads an EDS with python-canopen and prints what it understood, as JSON.

A second opinion on the data sheets: nothing here is shared with axcon. Needs the package canopen.

    read_eds.py FILE NODE_ID

One object for each entry: index, sub, name, type, access, mappable, default, low, high, unit.
"""

import json
import sys

import canopen
from canopen.objectdictionary import ODArray, ODRecord, ODVariable


def entry(variable: ODVariable) -> dict:
    return {
        "index": variable.index,
        "sub": variable.subindex,
        "name": variable.name,
        "type": variable.data_type,
        "access": variable.access_type,
        "mappable": variable.pdo_mappable,
        "default": variable.default,
        "low": variable.min,
        "high": variable.max,
        "unit": variable.unit,
    }


def main() -> int:
    path, node_id = sys.argv[1], int(sys.argv[2])
    dictionary = canopen.import_od(path, node_id)
    entries = []
    for index in sorted(dictionary):
        item = dictionary[index]
        if isinstance(item, ODVariable):
            entries.append(entry(item))
        elif isinstance(item, (ODArray, ODRecord)):
            # Iterating an array stops at its first gap; the sub-indices themselves do not lie.
            entries.extend(entry(item.subindices[sub]) for sub in sorted(item.subindices))
    json.dump({"objects": len(dictionary), "entries": entries}, sys.stdout)
    return 0


if __name__ == "__main__":
    sys.exit(main())
