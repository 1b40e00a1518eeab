"""Reads the materials and lights of a log for verify_log.py."""
from log_cursor import check

MAX_DEFINITIONS = 4096
# By number - 1: the default and the limits, except those of a light's kind.
LUMINANCE, SHARE = (0.0, 0.0, 1e10), (0.0, 0.0, 1.0)
MATERIAL_PROPERTIES = [(1.0, 0.0, 1.0), (0.0, 0.0, 1e6)] + 3 * [(0.8, 0.0, 1.0)] + [
    SHARE, (1.0, 0.0, 1.0)] + 3 * [LUMINANCE] + [SHARE, (1.5, 1.0, 4.0)]
LIGHT_PROPERTIES = 3 * [(1.0, 0.0, 1e3)] + [(0.0, 0.0, 1e7), (0.0, 0.0, 1e10), (0.0, 0.0, 3.1416),
                                            (0.0, 0.0, 3.1416), (0.0, 0.0, 0.2)] + 9 * [LUMINANCE]
LIGHT_PROPERTIES += 3 * [(0.0, -1e5, 1e5)]
# The numbers of the properties that lights of a kind use, and those of them that are not 0.
USED_BY_KIND = {1: {1, 2, 3, 4, 8}, 2: {1, 2, 3, 5, 18, 19, 20},
                3: {1, 2, 3, 5, 6, 7, 18, 19, 20}, 4: set(range(9, 18))}
NEEDED_BY_KIND = {1: {4}, 2: {5}, 3: {5, 7}, 4: set()}


def read_definition(cursor, properties):
    """(index, name, kind, values)"""
    index, count, length, kind = cursor.get("IIII")
    check(index < MAX_DEFINITIONS and length <= 4096, "no material or light")
    values, previous = [default for default, _, _ in properties], 0
    for _ in range(count):
        number, reserved, value = cursor.get("IId")
        check(previous < number <= len(properties) and reserved == 0, "an unknown property")
        default, lowest, highest = properties[number - 1]
        check(value != default, "a property with its default value")
        check(lowest <= value <= highest, "a property beyond its limits")
        values[number - 1], previous = value, number
    name = cursor.take(length).decode()
    cursor.skip_zeros(8)
    return index, name, kind, values


def read_material(cursor):
    material = index, _, kind, values = read_definition(cursor, MATERIAL_PROPERTIES)
    check(index > 0 and kind == 0 and (values[1] == 0 or values[1] >= 1), "no material")
    return material


def read_light(cursor):
    light = _, _, kind, values = read_definition(cursor, LIGHT_PROPERTIES)
    check(kind in USED_BY_KIND, "a light of unknown kind")
    for number, (value, (default, _, _)) in enumerate(zip(values, LIGHT_PROPERTIES), 1):
        check(number in USED_BY_KIND[kind] or value == default, "a property that the kind does not use")
        check(number not in NEEDED_BY_KIND[kind] or value != 0, "a light without its value")
    check(kind != 3 or values[5] <= values[6] >= 0.01, "a spot with wrong angles")
    check(any(values[:3]), "a light without a colour")
    return light
