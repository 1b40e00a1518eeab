// Writers move pairs of bodies together in a database with a device, and readers query their positions by
// rays, regions and nearest queries. Both bodies of a pair are always at the same place, and the places agree
// with the version, for the latest version, a pinned one, and one as of a past time.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <memory>
#include <random>
#include <sstream>
#include <thread>
#include <utility>

#include <rtstdb/database.hpp>

#include "tests/support/eventually.hpp"
#include "tests/support/rounds.hpp"

namespace hil::long_test {
namespace {

using namespace rtstdb;

constexpr std::uint32_t pairs = 64;
constexpr std::uint32_t places = 8;
/// Of a large batch, which the database splits into chunks with preemption points.
constexpr std::uint32_t max_repeats = 6;
constexpr std::uint32_t elements_per_repeat = 2 * pairs + pairs * places + pairs;

constexpr double place_x_m(std::uint32_t place) {
  return 10.0 * place;
}
constexpr double pair_y_m(std::uint32_t pair) {
  return 4.0 * pair;
}
constexpr double body_z_m(std::uint32_t body) {
  return 2.0 * body;
}
/// Pairs with the same mask are far from each other.
constexpr std::uint32_t mask_of(std::uint32_t pair) {
  return 1u << (pair % 32);
}

/// By pair; of an invalid observation another number.
using Places = std::array<std::int64_t, pairs>;

struct Read {
  Version version = 0;
  Places places{};
};
struct Move {
  Version version = 0;
  std::uint32_t pair = 0, place = 0;
};

template <class Value>
Value value_of(Result<Value> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(result).value();
}

/// The database and its pairs.
struct World {
  World() {
    DatabaseOptions options;
    if (const char* select = std::getenv("HIL_TEST_GPU"); select != nullptr) options.gpu = select;
    options.validation = Validation::off;
    options.max_entities = 256;
    options.retained_changes = 1u << 9;  // so few that some old versions are not available
    options.chunk = Nanoseconds(200'000);
    database = value_of(Database::open(options));
    geometry = value_of(database->add_geometry(make_box({1.0, 1.0, 1.0}), "body"));
    // One for each place; place 0 has the default material.
    for (std::uint32_t place = 1; place < places; ++place)
      value_of(database->add_material({}, "place " + std::to_string(place)));
    const auto transaction = database->make_transaction({.max_writes = 2 * pairs});
    transaction->begin({});
    for (std::uint32_t k = 0; k < 2 * pairs; ++k)
      transaction->create(row_at(k / 2, k % 2, first_place(k / 2)));
    const Outcome& outcome = database->execute(*transaction);
    if (!outcome.done()) throw std::runtime_error(describe(outcome));
    for (std::uint32_t k = 0; k < 2 * pairs; ++k)
      entities.push_back(transaction->created(k));
    first_version = {outcome.version, outcome.version_time};
  }
  static std::uint32_t first_place(std::uint32_t pair) { return pair % places; }
  EntityRow row_at(std::uint32_t pair, std::uint32_t body, std::uint32_t place) const {
    EntityRow row;
    row.geometry = geometry;
    row.mask = mask_of(pair);
    row.material = {place};
    row.motion.p_world_m = {place_x_m(place), pair_y_m(pair), body_z_m(body)};
    return row;
  }

  std::unique_ptr<Database> database;
  GeometryId geometry;
  std::vector<EntityId> entities;  ///< two for each pair
  VersionInfo first_version;
  std::atomic<std::uint64_t> elements{0};  ///< answered
  std::atomic<bool> stop{false};
};

class Reader {
 public:
  Reader(World& world, std::uint32_t seed)
      : world_(world),
        random_(seed),
        rays_(value_of(world.database->prepare(
            RayQueryOptions{.name = "pair rays", .capacity = 2 * pairs * max_repeats}))),
        regions_(value_of(world.database->prepare(RegionQueryOptions{
            .name = "pair regions", .capacity = pairs * places * max_repeats, .ids_per_region = 4}))),
        points_(value_of(world.database->prepare(
            NearestQueryOptions{.name = "pair points", .capacity = pairs * max_repeats, .k = 2}))),
        transaction_(world.database->make_transaction({.max_queries = 3})) {}

  void run() {
    while (!world_.stop.load(std::memory_order_relaxed)) {
      const std::uint32_t repeats = random_() % 3 == 0 ? max_repeats : 1;
      const VersionInfo latest = world_.database->latest();
      Terms terms;
      terms.read_at = read_at(latest);
      terms.importance = static_cast<std::uint8_t>(random_() % 3);
      const bool old = terms.read_at.kind != ReadAt::Kind::latest;
      // Writers advance the world time by microseconds: this time is after that of any version that is read.
      const WorldTime after = latest.time + Nanoseconds(100'000'000);
      declare(repeats, terms.read_at.kind == ReadAt::Kind::time ? terms.read_at.time : after);
      transaction_->begin(terms);
      transaction_->add_query(*rays_, 2 * pairs * repeats);
      transaction_->add_query(*regions_, pairs * places * repeats);
      transaction_->add_query(*points_, pairs * repeats);
      const Outcome& outcome = world_.database->execute(*transaction_);
      if (outcome.status == Status::bad_input && old) continue;  // the version is not available any more
      if (!outcome.done() || outcome.truncated) return report("unexpected outcome: " + describe(outcome));
      old_reads += old ? 1 : 0;
      check(outcome, repeats);
      world_.elements.fetch_add(repeats * elements_per_repeat, std::memory_order_relaxed);
    }
  }

  std::uint64_t old_reads = 0;
  std::string mismatch;  ///< the first
  std::vector<Read> reads;

 private:
  ReadAt read_at(const VersionInfo& latest) {
    const Version back = random_() % 200;
    switch (random_() % 4) {
      case 0:
        return ReadAt::pinned(
            std::max(latest.version - std::min(back, latest.version), world_.first_version.version));
      case 1:
        return ReadAt::as_of(std::max(latest.time - Nanoseconds(static_cast<std::int64_t>(back) * 1000),
                                      world_.first_version.time));
      default:
        return ReadAt::latest();
    }
  }

  void declare(std::uint32_t repeats, WorldTime t) {
    for (std::uint32_t k = 0; k < pairs * repeats; ++k) {
      const std::uint32_t pair = k % pairs;
      const auto y_m = static_cast<float>(pair_y_m(pair));
      for (std::uint32_t body = 0; body < 2; ++body) {
        Ray& ray = rays_->rays()[2 * k + body];
        ray = {};
        ray.origin_m = {-20.0f, y_m, static_cast<float>(body_z_m(body))};
        ray.t = t;
      }
      for (std::uint32_t place = 0; place < places; ++place) {
        Region& region = regions_->regions()[k * places + place];
        region = {};
        region.center_m = {static_cast<float>(place_x_m(place)), y_m, 1.0f};
        region.half_extent_m = {1.0f, 1.0f, 2.0f};
        region.t = t;
      }
      Nearest& point = points_->points()[k];
      point = {};
      point.point_m = {35.0f, y_m, 1.0f};
      point.mask = mask_of(pair);
      point.t = t;
    }
  }

  void report(const std::string& text) {
    if (mismatch.empty()) mismatch = text;
    world_.stop.store(true);
  }

  /// All elements about a pair have to give the same place.
  void check(const Outcome& outcome, std::uint32_t repeats) {
    Read read{.version = outcome.version};
    read.places.fill(-1);
    for (std::uint32_t k = 0; k < pairs * repeats; ++k) {
      const std::uint32_t pair = k % pairs;
      std::int64_t& known = read.places[pair];
      const auto expect_place = [&](std::int64_t place, const char* by) {
        if (known < 0) known = place;
        if (known == place && place >= 0) return;
        std::ostringstream text;
        text << "version " << outcome.version << ": pair " << pair << " is at place " << known << " and, by "
             << by << ", at " << place;
        report(text.str());
      };
      const EntityId* const bodies = &world_.entities[2 * pair];
      for (std::uint32_t body = 0; body < 2; ++body)
        expect_place(place_by_ray(rays_->hits()[2 * k + body], bodies[body]), "a ray");
      for (std::uint32_t place = 0; place < places; ++place) {
        const RegionAnswer& answer = regions_->answers()[k * places + place];
        if (answer.found == 2 && answer.entities[0] == bodies[0] && answer.entities[1] == bodies[1]) {
          expect_place(place, "a region");
        } else if (answer.found != 0 || known == place) {
          expect_place(-2, "a region without both bodies");
        }
      }
      for (const Neighbor& neighbor : points_->answers()[k].neighbors)
        expect_place(place_by_distance(neighbor), "a nearest query");
      if (points_->answers()[k].neighbors.size() != 2)
        expect_place(-5, "a nearest query without both bodies");
    }
    reads.push_back(read);
  }

  /// The material of the row, which has to agree with the position.
  static std::int64_t place_by_ray(const RayHit& hit, EntityId expected) {
    if (hit.status != HitStatus::hit || hit.entity != expected) return -3;
    const bool agrees =
        std::abs(static_cast<double>(hit.lambda) - (19.5 + place_x_m(hit.material.index))) < 1e-3;
    return agrees ? static_cast<std::int64_t>(hit.material.index) : -4;
  }
  static std::int64_t place_by_distance(const Neighbor& neighbor) {
    const double x_m = std::max(0.0, std::abs(place_x_m(neighbor.material.index) - 35.0) - 0.5);
    const bool agrees = std::abs(static_cast<double>(neighbor.distance_m) - std::hypot(x_m, 0.5)) < 1e-3;
    return agrees ? static_cast<std::int64_t>(neighbor.material.index) : -6;
  }

  World& world_;
  std::minstd_rand random_;
  std::unique_ptr<RayQuery> rays_;
  std::unique_ptr<RegionQuery> regions_;
  std::unique_ptr<NearestQuery> points_;
  std::unique_ptr<Transaction> transaction_;
};

/// Moves some pairs in each transaction. Some transactions miss their deadline or are cancelled.
class Writer {
 public:
  Writer(World& world, std::uint32_t seed)
      : world_(world), random_(seed), transaction_(world.database->make_transaction({.max_writes = 16})) {}

  void run() {
    while (!world_.stop.load(std::memory_order_relaxed)) {
      Terms terms;
      terms.world_time = world_.database->latest().time + Nanoseconds(1000);
      terms.importance = static_cast<std::uint8_t>(random_() % 3);
      if (random_() % 4 == 0) {
        terms.deadline_class = DeadlineClass::firm;
        terms.deadline = clock_time_ns(std::chrono::steady_clock::now().time_since_epoch().count()) +
                         Nanoseconds(random_() % 300'000);
      }
      transaction_->begin(terms);
      std::vector<Move> made;
      for (auto count = 1 + random_() % 4; count > 0; --count) {
        const auto pair = static_cast<std::uint32_t>(random_() % pairs);
        const auto place = static_cast<std::uint32_t>(random_() % places);
        for (std::uint32_t body = 0; body < 2; ++body)
          transaction_->update(world_.entities[2 * pair + body], world_.row_at(pair, body, place));
        made.push_back({0, pair, place});
      }
      world_.database->submit(*transaction_);
      if (random_() % 8 == 0) world_.database->cancel(*transaction_);
      const Outcome& outcome = world_.database->wait(*transaction_);
      for (Move& move : made)
        move.version = outcome.version;
      if (outcome.done())
        moves.insert(moves.end(), made.begin(), made.end());
      else
        ++not_committed;
      // Paced, so that readers run and old versions stay available for them.
      std::this_thread::sleep_for(std::chrono::microseconds(random_() % 400));
    }
  }

  std::uint64_t not_committed = 0;
  std::vector<Move> moves;

 private:
  World& world_;
  std::minstd_rand random_;
  std::unique_ptr<Transaction> transaction_;
};

/// Compares what was read with the moves, version by version. The first mismatch; empty: none.
std::string mismatch_of_versions(std::vector<Read> reads, std::vector<Move> moves) {
  std::ranges::stable_sort(reads, {}, &Read::version);
  std::ranges::stable_sort(moves, {}, &Move::version);  // the moves of one version keep their order
  Places expected{};
  for (std::uint32_t pair = 0; pair < pairs; ++pair)
    expected[pair] = World::first_place(pair);
  auto next = moves.begin();
  for (const Read& read : reads) {
    for (; next != moves.end() && next->version <= read.version; ++next)
      expected[next->pair] = next->place;
    const auto found = std::ranges::mismatch(read.places, expected);
    if (found.in1 == read.places.end()) continue;
    std::ostringstream text;
    text << "version " << read.version << ": pair " << found.in1 - read.places.begin()
         << " was read at place " << *found.in1 << " and is at " << *found.in2;
    return text.str();
  }
  return {};
}

TEST(PairMoves, AreReadWholeOrNotAtAll) {
  const std::uint64_t elements = tests::rounds(100'000, 10'000'000);
  constexpr Version min_versions = 50;
  World world;
  std::vector<std::unique_ptr<Reader>> readers;
  std::vector<std::unique_ptr<Writer>> writers;
  for (std::uint32_t k = 0; k < 4; ++k)
    readers.push_back(std::make_unique<Reader>(world, 701 + k));
  for (std::uint32_t k = 0; k < 2; ++k)
    writers.push_back(std::make_unique<Writer>(world, 751 + k));
  std::vector<std::thread> threads;
  for (const auto& reader : readers)
    threads.emplace_back([&reader] { reader->run(); });
  for (const auto& writer : writers)
    threads.emplace_back([&writer] { writer->run(); });
  tests::eventually(
      [&] {
        const Version versions = world.database->latest().version - world.first_version.version;
        return world.stop || (world.elements >= elements && versions >= min_versions);
      },
      std::chrono::hours(1));
  world.stop = true;
  for (std::thread& thread : threads)
    thread.join();
  std::uint64_t old_reads = 0;
  std::uint64_t not_committed = 0;
  std::vector<Read> reads;
  std::vector<Move> moves;
  for (const auto& reader : readers) {
    EXPECT_EQ(reader->mismatch, "");
    old_reads += reader->old_reads;
    reads.insert(reads.end(), reader->reads.begin(), reader->reads.end());
  }
  for (const auto& writer : writers) {
    not_committed += writer->not_committed;
    moves.insert(moves.end(), writer->moves.begin(), writer->moves.end());
  }
  std::cout << world.elements << " elements in " << reads.size() << " transactions, " << old_reads
            << " of old versions; " << moves.size() << " moves, " << not_committed
            << " transactions without a commit\n";
  EXPECT_EQ(mismatch_of_versions(std::move(reads), std::move(moves)), "");
  EXPECT_GE(world.elements, elements);
  EXPECT_GT(old_reads, 0u);
  EXPECT_GT(not_committed, 0u);
}

}  // namespace
}  // namespace hil::long_test
