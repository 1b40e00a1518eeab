#include "rtstdb/scheduler/hand_over.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

#include "rtstdb/transaction/latest_version.hpp"

namespace rtstdb::transaction {
namespace {

using scheduler::HandOver;
using scheduler::HandOverLink;

struct Item : HandOverLink {
  std::uint32_t producer = 0;
  std::uint32_t number = 0;
};

TEST(HandOver, LosesAndRepeatsNothingWithEightProducers) {
  constexpr std::uint32_t producers = 8;
  constexpr std::uint32_t items_each = 20000;
  HandOver hand_over;
  std::vector<std::vector<Item>> items(producers, std::vector<Item>(items_each));
  std::vector<std::uint32_t> accepted(producers, 0);
  std::vector<std::thread> threads;
  threads.reserve(producers);
  for (std::uint32_t producer = 0; producer < producers; ++producer) {
    threads.emplace_back([&, producer] {
      for (std::uint32_t number = 0; number < items_each; ++number) {
        Item& item = items[producer][number];
        item.producer = producer;
        item.number = number;
        if (!hand_over.push(item)) return;
        ++accepted[producer];
      }
    });
  }
  std::vector<std::uint32_t> next(producers, 0);
  std::uint32_t total = 0;
  const auto receive = [&](HandOverLink* taken) {
    for (; taken != nullptr; taken = taken->next) {
      const auto& item = static_cast<Item&>(*taken);
      ASSERT_EQ(item.number, next[item.producer]) << "each producer's items stay in order";
      ++next[item.producer];
      ++total;
    }
  };
  while (total < producers * items_each / 2)
    receive(hand_over.take_all());
  receive(hand_over.close());
  for (std::thread& thread : threads)
    thread.join();
  Item late;
  EXPECT_FALSE(hand_over.push(late)) << "it stays closed";
  EXPECT_EQ(next, accepted) << "every accepted item is received, also during close";
}

TEST(LatestVersion, ReturnsVersionAndTimeOfOneSet) {
  LatestVersion latest({0, world_time_ns(0)});
  std::atomic<bool> stop{false};
  std::vector<std::thread> readers;
  readers.reserve(3);
  std::atomic<std::uint64_t> mismatches{0};
  for (int k = 0; k < 3; ++k) {
    readers.emplace_back([&] {
      Version newest = 0;
      while (!stop) {
        const VersionInfo info = latest.get();
        if (info.time.time_since_epoch().count() != static_cast<std::int64_t>(info.version * 3)) ++mismatches;
        if (info.version < newest) ++mismatches;
        newest = info.version;
      }
    });
  }
  for (Version version = 1; version <= 300000; ++version) {
    latest.set({version * 5, world_time_ns(static_cast<std::int64_t>(version * 15))});
  }
  stop = true;
  for (std::thread& reader : readers)
    reader.join();
  EXPECT_EQ(mismatches, 0u);
  EXPECT_EQ(latest.get().version, 1500000u);
}

}  // namespace
}  // namespace rtstdb::transaction
