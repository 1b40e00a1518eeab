"""XXH3 of 64 bits with a seed, by its specification; slow, and of no other origin than what writes the log."""
import struct

SECRET = bytes.fromhex(
    "b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671f"
    "cb79e64eccc0e578825ad07dccff7221b8084674f743248ee03590e6813a264c"
    "3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8"
    "a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364"
    "eac5ac8334d3ebc3c581a0fffa1363eb170ddd51b7f0da49d316552629d4689e"
    "2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e")
MASK = (1 << 64) - 1
P32_1, P32_2, P32_3 = 0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D
P64_1, P64_2, P64_3, P64_4, P64_5 = (0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0x85EBCA77C2B2AE63,
                                     0x27D4EB2F165667C5)
MX1, MX2 = 0x165667919E3779F9, 0x9FB21C651E98DF25


def u32(data, at):
    return struct.unpack_from("<I", data, at)[0]


def u64(data, at):
    return struct.unpack_from("<Q", data, at)[0]


def swapped(value, size):
    return int.from_bytes(value.to_bytes(size, "little"), "big")


def rotated(value, by):
    return (value << by | value >> (64 - by)) & MASK


def folded(a, b):
    product = a * b
    return (product & MASK) ^ (product >> 64)


def avalanche(h):
    h ^= h >> 37
    h = h * MX1 & MASK
    return h ^ h >> 32


def avalanche_of_xxh64(h):
    h ^= h >> 33
    h = h * P64_2 & MASK
    h ^= h >> 29
    h = h * P64_3 & MASK
    return h ^ h >> 32


def mixed(data, at, secret_at, seed):
    low = u64(data, at) ^ (u64(SECRET, secret_at) + seed & MASK)
    high = u64(data, at + 8) ^ (u64(SECRET, secret_at + 8) - seed & MASK)
    return folded(low, high)


def up_to_16(data, seed):
    n = len(data)
    if n == 0:
        return avalanche_of_xxh64(seed ^ u64(SECRET, 56) ^ u64(SECRET, 64))
    if n <= 3:
        combined = data[0] << 16 | data[n >> 1] << 24 | data[-1] | n << 8
        return avalanche_of_xxh64(combined ^ ((u32(SECRET, 0) ^ u32(SECRET, 4)) + seed & MASK))
    if n <= 8:
        seed ^= swapped(seed & 0xFFFFFFFF, 4) << 32
        flip = (u64(SECRET, 8) ^ u64(SECRET, 16)) - seed & MASK
        h = (u32(data, n - 4) + (u32(data, 0) << 32)) ^ flip
        h ^= rotated(h, 49) ^ rotated(h, 24)
        h = h * MX2 & MASK
        h ^= (h >> 35) + n
        h = h * MX2 & MASK
        return h ^ h >> 28
    low = u64(data, 0) ^ ((u64(SECRET, 24) ^ u64(SECRET, 32)) + seed & MASK)
    high = u64(data, n - 8) ^ ((u64(SECRET, 40) ^ u64(SECRET, 48)) - seed & MASK)
    return avalanche(n + swapped(low, 8) + high + folded(low, high) & MASK)


def up_to_240(data, seed):
    n = len(data)
    total = n * P64_1
    if n <= 128:
        for k in range((n - 1) // 32, -1, -1):
            total += mixed(data, 16 * k, 32 * k, seed) + mixed(data, n - 16 * (k + 1), 32 * k + 16, seed)
        return avalanche(total & MASK)
    for k in range(8):
        total += mixed(data, 16 * k, 16 * k, seed)
    total = avalanche(total & MASK)
    for k in range(8, n // 16):
        total += mixed(data, 16 * k, 16 * (k - 8) + 3, seed)
    return avalanche(total + mixed(data, n - 16, 136 - 17, seed) & MASK)


def longer(data, seed):
    n = len(data)
    words = struct.unpack("<24Q", SECRET)
    secret = struct.pack("<24Q", *((word + (seed if k % 2 == 0 else -seed)) & MASK for k, word in enumerate(words)))
    lanes = [P32_3, P64_1, P64_2, P64_3, P64_4, P32_2, P64_5, P32_1]

    def accumulate(at, secret_at):
        values = struct.unpack_from("<8Q", data, at)
        keys = struct.unpack_from("<8Q", secret, secret_at)
        for k in range(8):
            key = values[k] ^ keys[k]
            lanes[k ^ 1] = lanes[k ^ 1] + values[k] & MASK
            lanes[k] = lanes[k] + (key & 0xFFFFFFFF) * (key >> 32) & MASK

    blocks = (n - 1) // 1024
    for block in range(blocks):
        for stripe in range(16):
            accumulate(1024 * block + 64 * stripe, 8 * stripe)
        for k in range(8):
            lanes[k] = (lanes[k] ^ lanes[k] >> 47 ^ u64(secret, 128 + 8 * k)) * P32_1 & MASK
    for stripe in range((n - 1 - 1024 * blocks) // 64):
        accumulate(1024 * blocks + 64 * stripe, 8 * stripe)
    accumulate(n - 64, 192 - 64 - 7)
    total = n * P64_1
    for k in range(4):
        total += folded(lanes[2 * k] ^ u64(secret, 11 + 16 * k), lanes[2 * k + 1] ^ u64(secret, 19 + 16 * k))
    return avalanche(total & MASK)


def xxh3_64(data, seed):
    if len(data) <= 16:
        return up_to_16(data, seed)
    return up_to_240(data, seed) if len(data) <= 240 else longer(data, seed)
