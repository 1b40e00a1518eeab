#!/usr/bin/env python3
"""verify_log.py DIRECTORY...   reads logs of rtstdb and prints their newest versions.

It follows the description of the format (rtstdb/log/format.hpp) and shares only the hash function with the
writer. For each directory it prints a line "== DIRECTORY", then "refused: REASON", or the newest version: its
rows, free indices, geometries, materials and lights, one to a line, floating-point numbers by their bits.
Exits with 1 when any log was refused.
"""
import ctypes
import os
import re
import struct
import sys

from log_cursor import Cursor, Refused, check
from log_definitions import read_light, read_material

LIBRARY = ctypes.CDLL("libxxhash.so.0")
LIBRARY.XXH3_64bits_withSeed.restype = ctypes.c_uint64
LIBRARY.XXH3_64bits_withSeed.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint64]

SECTOR, FORMAT, WORDS_OF_MOTION = 512, 5, 14
MAX_ENTITIES, MAX_GEOMETRIES, NONE = 1 << 20, 1 << 16, 0xFFFFFFFF
COMMIT, GEOMETRY, DISCARD, GAP, MOVE, MATERIAL, LIGHT = 1, 2, 3, 4, 5, 6, 7
# Reasons to omit the last word of a motion, and the world time of a move.
VALID_FROM_WORLD_TIME, SAME_WORLD_TIME = 1 << 14, 1 << 15
CREATE, UPDATE, UPDATE_MOTION, REMOVE = 1, 2, 3, 4


def xxh3_64(data, seed):
    return LIBRARY.XXH3_64bits_withSeed(data, len(data), seed)


class Segment:
    def __init__(self, directory, number):
        self.number = number
        self.data = directory.read(f"segment.{number:010}")
        self.ok = False
        if len(self.data) < 64:
            return
        (magic, self.format, self.sectors, self.database, stored_number, self.first_group, self.link, _,
         checksum) = struct.unpack_from("<8sIIQQQQQQ", self.data)
        if magic != b"RTSTLOG1" or checksum != xxh3_64(self.data[:56], self.database):
            return
        check(self.format == FORMAT, f"segment {number}: format {self.format}")
        self.ok = stored_number == number  # otherwise it was copied over another one, or renamed

    def header_at(self, at):
        """(flags, number, payload bytes, records, link, payload checksum, checksum), or None."""
        if at + 72 > len(self.data):
            return None
        (magic, flags, number, length, records, _, _, _, link, payload, checksum) = struct.unpack_from(
            "<IIQIIQQqQQQ", self.data, at)
        if magic != 0x47545352 or checksum != xxh3_64(self.data[at:at + 64], self.database):
            return None
        return flags, number, length, records, link, payload, checksum

    def later_group(self, at, number):
        while at < len(self.data):
            header = self.header_at(at)
            if header and header[1] >= number:
                return True
            at += SECTOR
        return False


class Directory:
    def __init__(self, path):
        self.path = path
        self.names = sorted(os.listdir(path))

    def numbers(self, kind):
        found = (re.fullmatch(rf"{kind}\.(\d{{10}})", name) for name in self.names)
        return [int(match.group(1)) for match in found if match]

    def read(self, name):
        check(name in self.names, f"{name} is missing")
        with open(os.path.join(self.path, name), "rb") as file:
            return file.read()


def completed(change, before, version):
    """The motion that a write leaves, with its omitted words from the row before."""
    unchanged, follows, words = change
    check(not unchanged or follows == before[0] & 0xFFFF,
          f"version {version} does not follow its base version")
    motion, at = b"", 0
    for k in range(WORDS_OF_MOTION):
        if unchanged >> k & 1:
            motion += before[3][8 * k:8 * k + 8]
        else:
            motion += words[at:at + 8]
            at += 8
    return motion


class World:
    def __init__(self):
        self.version, self.time, self.next = 0, -((1 << 62) - 1), 1
        self.rows, self.generations, self.geometries, self.materials = {}, {}, [], []
        self.lights = []
        self.before = None

    def add_geometry(self, geometry):
        index = geometry["index"]
        if index < len(self.geometries):
            old = self.geometries[index]
            check(all(old[key] == geometry[key] for key in ("file", "checksum", "name", "options")),
                  f"geometry {index} is different")
            return
        check(index == len(self.geometries), f"geometry {index} is not the next")
        self.geometries.append(geometry)

    def add_material(self, material):
        self.add_definition("material", self.materials, material[0] - 1, material)

    def add_light(self, light):
        self.add_definition("light", self.lights, light[0], light)

    @staticmethod
    def add_definition(noun, known, index, added):
        if index < len(known):
            check(known[index] == added, f"{noun} {added[0]} is different")
            return
        check(index == len(known), f"{noun} {added[0]} is not the next")
        known.append(added)

    def check_appearance(self, appearance):
        material, light = struct.unpack_from("<HH", appearance, 28)
        check(material <= len(self.materials), f"material {material} does not exist")
        check(light <= len(self.lights), f"light {light - 1} does not exist")

    def knows(self, geometry):
        return geometry == NONE or geometry < len(self.geometries)

    def apply(self, commit):
        version, time, writes, shapes = commit
        check(version > self.version and time >= self.time,
              f"version {version} does not follow {self.version}")
        self.before = (self.version, self.time, dict(self.rows), dict(self.generations),
                       [(g["shape"], g["shape_by"]) for g in self.geometries])
        for kind, index, generation, geometry, body in writes:
            existing = self.rows.get(index)
            if kind == CREATE:
                check(existing is None, f"version {version} creates {index}, which exists")
                check(generation == (self.generations.get(index, 0) + 1) % (1 << 32),
                      "another generation is next")
            else:
                check(existing is not None and self.generations[index] == generation,
                      f"{index} does not exist")
            check(self.knows(geometry), f"geometry {geometry} does not exist")
            self.generations[index] = generation
            if kind == REMOVE:
                del self.rows[index]
            elif kind == UPDATE_MOTION:
                self.rows[index] = (version, existing[1], existing[2], completed(body, existing, version))
            else:
                self.check_appearance(body)
                self.rows[index] = (version, geometry, body[:32], body[32:])
        for index, positions in shapes:
            check(index < len(self.geometries) and self.geometries[index]["options"][0] == 1,
                  "it does not deform")
            geometry = self.geometries[index]
            check(len(positions) == 12 * geometry["positions"], "another number of positions")
            geometry["shape"], geometry["shape_by"] = positions, version
        self.version, self.time, self.next = version, time, max(self.next, version + 1)

    def discard(self, version):
        check(self.before is not None and version == self.version, f"{version} is not the last")
        self.version, self.time, self.rows, self.generations, shapes = self.before
        for geometry, (shape, by) in zip(self.geometries, shapes):
            geometry["shape"], geometry["shape_by"] = shape, by
        self.before = None

    def lines(self):
        yield f"version {self.version} time {self.time} next {self.next}"
        for index in sorted(self.generations):
            if index not in self.rows:
                if self.generations[index]:
                    yield f"free {index} generation {self.generations[index]}"
                continue
            by, geometry, appearance, motion = self.rows[index]
            mask, material, light = struct.unpack_from("<IHH", appearance, 24)
            doubles = struct.unpack("<3Q", appearance[:24]) + struct.unpack("<13Q", motion[:104])
            light = light - 1 if light else NONE
            yield (f"row {index} generation {self.generations[index]} by {by} geometry {geometry} "
                   f"mask {mask} material {material} light {light} " +
                   " ".join(f"{bits:016x}" for bits in doubles) +
                   f" from {struct.unpack('<q', motion[104:])[0]}")
        for g in self.geometries:
            yield " ".join([f"geometry {g['index']} {g['name']} positions {g['positions']} "
                            f"triangles {g['triangles']} shape {g['shape_by']}"] +
                           bits_of_vectors(g["shape"]) + ["normals"] + bits_of_vectors(g["normals"]) +
                           ["colors"] + bits_of_vectors(g["colors"]))
        for noun, definitions in (("material", self.materials), ("light", self.lights)):
            for index, name, kind, values in definitions:
                bits = struct.unpack(f"<{len(values)}Q", struct.pack(f"<{len(values)}d", *values))
                yield f"{noun} {index} {name} {kind} " + " ".join(f"{value:016x}" for value in bits)


def bits_of_vectors(data):
    floats = struct.unpack(f"<{len(data) // 4}I", data)
    return ["".join(f"{bits:08x}" for bits in floats[k:k + 3]) for k in range(0, len(floats), 3)]


def read_geometry(cursor):
    file, checksum, index, deforms, kept, growth, length, reserved = cursor.get("QQIIIfII")
    check(index < MAX_GEOMETRIES and deforms <= 1 and reserved == 0 and length <= 4096 and file,
          "no geometry")
    name = cursor.take(length).decode()
    cursor.skip_zeros(8)
    return {"index": index, "file": file, "checksum": checksum, "name": name,
            "options": (deforms, kept, growth), "shape": b"", "shape_by": 0, "positions": 0, "triangles": 0,
            "normals": b"", "colors": b""}


def read_mesh(directory, geometry, database):
    data = directory.read(f"geometry.{geometry['file']:010}")
    (magic, form, parts, database_id, number, positions, triangles, solid, values, *_, payload,
     checksum) = Cursor(data).get("8sIIQQIIII12dQQ")
    check(magic == b"RTSTGEO1" and form == FORMAT, "another format")
    check(database_id == database and number == geometry["file"], "another file")
    check(checksum == geometry["checksum"] == xxh3_64(data[:152], database),
          f"geometry {number}: damaged header")
    check(solid <= 4, f"geometry {number}: solid of kind {solid}")
    check(values <= 3, f"geometry {number}: corner values of kind {values}")
    end = 160 + 12 * (positions + triangles)
    for _ in range(parts):
        check(len(data) >= end + 4, f"geometry {number}: another length")
        end += 4 + 12 * struct.unpack_from("<I", data, end)[0]
    for bit, key in (1, "normals"), (2, "colors"):
        if values & bit:
            geometry[key] = data[end:end + 36 * triangles]
            end += 36 * triangles
    check(len(data) == end, f"geometry {number}: another length")
    check(payload == xxh3_64(data[160:], database), f"geometry {number}: damaged mesh")
    geometry["positions"], geometry["triangles"] = positions, triangles


def read_shape(cursor):
    index, positions = cursor.get("II")
    data = cursor.take(12 * positions)
    cursor.skip_zeros(8)
    return index, data


def read_change(body, omitted, follows, time):
    """An update_motion: (unchanged words, version of the row before, the other words)."""
    unchanged = omitted & (1 << WORDS_OF_MOTION) - 1
    check(omitted < SAME_WORLD_TIME and (unchanged or not follows), "no motion")
    stored = WORDS_OF_MOTION - bin(unchanged).count("1")
    if not omitted & VALID_FROM_WORLD_TIME:
        return unchanged, follows, body.take(8 * stored)
    check(not unchanged >> 13, "a time omitted twice")
    return unchanged, follows, body.take(8 * stored - 8) + struct.pack("<q", time)


def read_move(body, omitted, time):
    """A move record as a commit; `time` is that of the previous commit, or None."""
    version, index, generation = body.get("QII")
    version, follows = version & (1 << 48) - 1, version >> 48
    check(version > 0 and index < MAX_ENTITIES, "no move")
    if not omitted & SAME_WORLD_TIME:
        time = body.get("q")[0]
    check(time is not None, "a move without a world time")
    change = read_change(body, omitted & ~SAME_WORLD_TIME, follows, time)
    return version, time, [(UPDATE_MOTION, index, generation, NONE, change)], []


def read_records(payload, time):
    """Yields (kind, value, time); `time` is that of the previous commit, or None."""
    cursor = Cursor(payload)
    while cursor.left():
        kind, omitted, length = cursor.get("HHI")
        check(length >= 8 and length % 8 == 0, "no length of a record")
        check(kind == MOVE or not omitted, "a record other than a move omits words")
        body = Cursor(cursor.take(length - 8))
        if kind == COMMIT:
            version, time, writes, shapes = body.get("QqII")
            check(writes + shapes > 0 and version > 0, "an empty commit")
            listed = []
            for _ in range(writes):
                write, index, generation, geometry = body.get("IIII")
                check(CREATE <= write <= REMOVE and index < MAX_ENTITIES, "no write")
                check(write != REMOVE or geometry == 0, "a geometry where none can be")
                if write == UPDATE_MOTION:
                    row = read_change(body, geometry & 0xFFFF, geometry >> 16, time)
                else:
                    row = body.take(0 if write == REMOVE else 144)
                listed.append((write, index, generation, geometry if write <= UPDATE else NONE, row))
            value = (version, time, listed, [read_shape(body) for _ in range(shapes)])
        elif kind == MOVE:
            kind, value = COMMIT, read_move(body, omitted, time)
            time = value[1]
        elif kind == GEOMETRY:
            value = read_geometry(body)
        elif kind == MATERIAL:
            value = read_material(body)
        elif kind == LIGHT:
            value = read_light(body)
        elif kind == DISCARD:
            value, time = body.get("Q")[0], None
        elif kind == GAP:
            value, time = body.get("QQ"), None
        else:
            raise Refused(f"a record of kind {kind}")
        check(body.left() == 0, "extra bytes in a record")
        yield kind, value, time


def read_checkpoint(directory, number, database):
    """The world, and the position of the first group after it."""
    cursor = Cursor(directory.read(f"checkpoint.{number:010}"))
    (magic, form, limit, database_id, as_number, version, time, following, segment, offset, group, link, _,
     checksum) = cursor.get("8sIIQQQqQQQQQqQ")
    check(magic == b"RTSTCKP1" and form == FORMAT and as_number == number,
          f"checkpoint {number}: another header")
    check(checksum == xxh3_64(cursor.data[:96], database_id), f"checkpoint {number}: damaged header")
    if database_id != database:
        raise LookupError(f"checkpoint {number}: of another database")
    world = World()
    world.version, world.time, world.next = version, time, following
    index, chunk, kind = 0, 0, 0
    while kind != 4:
        at = cursor.at
        magic, kind, as_chunk, as_checkpoint, length, entries, payload, checksum = cursor.get("IIQQIIQQ")
        check(magic == 0x43545352 and as_chunk == chunk and as_checkpoint == number, "another chunk")
        check(checksum == xxh3_64(cursor.data[at:at + 40], database), "a chunk's header is damaged")
        body = Cursor(cursor.take(length))
        check(payload == xxh3_64(body.data, database), "a chunk is damaged")
        chunk += 1
        if kind == 1:
            world.add_geometry(read_geometry(body))
        elif kind == 2:
            for _ in range(entries):
                generation, existing, by, geometry, _ = body.get("IIQII")
                world.generations[index] = generation
                if existing:
                    world.rows[index] = (by, geometry, body.take(32), body.take(112))
                    world.check_appearance(world.rows[index][2])
                index += 1
        elif kind == 3:
            by = body.get("Q")[0]
            where, positions = read_shape(body)
            world.geometries[where].update(shape=positions, shape_by=by)
        elif kind == 5:
            world.add_material(read_material(body))
        elif kind == 6:
            world.add_light(read_light(body))
        check(body.left() == 0, "extra bytes in a chunk")
    check(cursor.left() == 0 and index == limit, f"checkpoint {number}: another length")
    return world, (segment, offset, group, link)


def segments_from(segments, position):
    """(segment, end group) in order: groups of a newer segment replace those of an older one."""
    chosen, end = [], None
    for segment in reversed(segments):
        if not segment.ok:
            check(chosen, f"segment {segment.number}: damaged header, or that of another segment")
            continue
        if end is not None and (segment.first_group >= end or end <= position[2]):
            continue
        chosen.append((segment, end))
        end = segment.first_group
    return chosen[::-1]


def groups(segments, position, time):
    """Records of each group from the position on; `time` is that of the world there, or None."""
    at_segment, offset, expected, link = position
    chosen = segments_from(segments, position)
    check(chosen or at_segment == 0, "all segments are missing")
    if chosen:
        first = chosen[0][0]
        check(first.first_group <= expected, f"group {expected} is missing")
        check(first.number == at_segment or (first.first_group == expected and first.link == link),
              f"segment {at_segment} is missing")
    for segment, end in chosen:
        at = offset if segment.number == at_segment else SECTOR
        check(at != SECTOR or segment.first_group != expected or segment.link == link, "it does not follow")
        while end is None or expected < end:
            place = f"segment {segment.number}, offset {at}, group {expected}"
            header = segment.header_at(at)
            whole = header and header[1] == expected and header[4] == link and header[0] <= 1
            payload = segment.data[at + 72:at + 72 + header[2]] if whole else b""
            whole = whole and len(payload) == header[2] and xxh3_64(payload, segment.database) == header[5]
            if not whole or header[0] == 1:
                later = segment.later_group(at + SECTOR, expected)
                cut = not whole and len(segment.data) < segment.sectors * SECTOR
                check(end is None and not later and not cut, f"{place}: damaged")
                return
            records = list(read_records(payload, time))
            check(len(records) == header[3] > 0, f"{place}: another number of records")
            time = records[-1][2]
            yield place, records
            at += -(-(72 + header[2]) // SECTOR) * SECTOR
            expected, link = expected + 1, header[6]


def verify(path):
    directory = Directory(path)
    segments = [Segment(directory, number) for number in directory.numbers("segment")]
    databases = [segment.database for segment in segments if segment.ok]
    check(len(set(databases)) <= 1, "segments of several databases")
    world, position, damaged = World(), (0, 0, 1, 0), []
    database = databases[0] if databases else None
    for number in reversed(directory.numbers("checkpoint")):
        try:
            if database is None:
                database = struct.unpack_from("<Q", directory.read(f"checkpoint.{number:010}"), 16)[0]
            world, position = read_checkpoint(directory, number, database)
            break
        except LookupError as other:
            raise Refused(str(other)) from other
        except (Refused, struct.error, IndexError, UnicodeDecodeError) as why:
            damaged.append(str(why))
            world, position = World(), (0, 0, 1, 0)
    check(position[0] or segments or not directory.numbers("geometry"), "geometries without a log")
    for geometry in world.geometries:
        read_mesh(directory, geometry, database)
    first_version = world.version
    for place, records in groups(segments, position, world.time if first_version else None):
        for kind, value, _ in records:
            try:
                if kind == COMMIT and value[0] > first_version:
                    world.apply(value)
                elif kind == DISCARD and value > first_version:
                    world.discard(value)
                elif kind == GEOMETRY:
                    if value["index"] >= len(world.geometries):
                        read_mesh(directory, value, database)
                    world.add_geometry(value)
                elif kind == MATERIAL:
                    world.add_material(value)
                elif kind == LIGHT:
                    world.add_light(value)
                elif kind == GAP and value[1] > first_version:
                    check(not damaged, f"only a damaged checkpoint continues after {value}")
                    return world
            except Refused as why:
                raise Refused(f"{place}: {why}") from why
    return world


def main():
    refused = False
    for path in sys.argv[1:]:
        print(f"== {path}")
        try:
            for line in verify(path).lines():
                print(line)
        except Refused as why:
            refused = True
            print(f"refused: {why}")
    return 1 if refused else 0


if __name__ == "__main__":
    sys.exit(main())
