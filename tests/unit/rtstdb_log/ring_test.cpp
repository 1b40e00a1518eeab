// The ring compared with a queue, between two threads, and at its limits.

#include "rtstdb/log/ring.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <deque>
#include <random>
#include <thread>

#include "rtstdb/log/format.hpp"

namespace rtstdb::log::test {
namespace {

/// A record of that size whose bytes follow from its number.
bool put(Ring& ring, std::uint32_t bytes, std::uint32_t number) {
  const auto space = ring.reserve(bytes);
  if (space.empty()) return false;
  const RecordHeader header{.kind = RecordKind::commit, .bytes = bytes};
  std::memset(space.data(), static_cast<int>(number % 251), space.size());
  std::memcpy(space.data(), &header, sizeof header);
  ring.commit();
  return true;
}

/// Takes all visible records; returns their sizes, or fails if a byte is wrong.
std::vector<std::uint32_t> take(Ring& ring, std::uint32_t& number) {
  std::vector<std::uint32_t> sizes;
  const auto records = ring.view();
  for (std::size_t place = 0; place < records.size();) {
    RecordHeader header;
    std::memcpy(&header, records.data() + place, sizeof header);
    for (std::size_t k = sizeof header; k < header.bytes; ++k)
      EXPECT_EQ(records[place + k], static_cast<std::byte>(number % 251));
    sizes.push_back(header.bytes);
    place += header.bytes;
    ++number;
  }
  ring.release(records.size());
  return sizes;
}

TEST(LogRing, BehavesLikeAQueue) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    std::mt19937_64 random(seed);
    Ring ring(64 + 8 * (random() % 40));
    std::deque<std::uint32_t> expected;
    std::uint32_t written = 0;
    std::uint32_t read = 0;
    for (int step = 0; step < 5000; ++step) {
      const auto bytes = static_cast<std::uint32_t>(8 + 8 * (random() % (ring.capacity() / 8)));
      const bool space = ring.has_space_for(bytes);
      if (random() % 3 != 0) {
        ASSERT_EQ(put(ring, bytes, written), space);
        if (space) {
          expected.push_back(bytes);
          ++written;
        }
        ASSERT_TRUE(space || bytes > ring.longest_record() || !expected.empty());
      } else {
        for (const std::uint32_t size : take(ring, read)) {
          ASSERT_FALSE(expected.empty());
          ASSERT_EQ(size, expected.front()) << "seed " << seed << " step " << step;
          expected.pop_front();
        }
      }
      ASSERT_LE(ring.used(), ring.capacity());
      ASSERT_LE(ring.used(), ring.high_water());
    }
    while (read != written)
      take(ring, read);
    EXPECT_EQ(ring.used(), 0u);
  }
}

TEST(LogRing, ReportsSpaceForTwoRecords) {
  std::mt19937_64 random(7);
  Ring ring(256);
  std::uint32_t read = 0;
  std::uint32_t written = 0;
  for (int step = 0; step < 5000; ++step) {
    const auto first = static_cast<std::uint32_t>(8 + 8 * (random() % 20));
    const auto second = static_cast<std::uint32_t>(8 + 8 * (random() % 8));
    if (ring.has_space_for(first, second)) {
      ASSERT_TRUE(put(ring, first, written++));
      ASSERT_TRUE(put(ring, second, written++));
    }
    if (random() % 2 == 0) take(ring, read);
  }
  EXPECT_GT(written, 1000u);
}

TEST(LogRing, PassesRecordsBetweenThreads) {
  Ring ring(4096);
  constexpr std::uint32_t count = 50'000;
  std::thread putting([&] {
    std::mt19937_64 random(3);
    for (std::uint32_t number = 0; number < count;) {
      if (put(ring, static_cast<std::uint32_t>(8 + 8 * (random() % 30)), number)) {
        ++number;
      } else {
        std::this_thread::yield();
      }
    }
  });
  std::uint32_t read = 0;
  while (read < count) {
    if (take(ring, read).empty()) std::this_thread::yield();
  }
  putting.join();
  EXPECT_EQ(ring.used(), 0u);
  EXPECT_LE(ring.high_water(), ring.capacity());
}

}  // namespace
}  // namespace rtstdb::log::test
