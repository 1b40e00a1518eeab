#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <sstream>
#include <thread>
#include <utility>

#include "tests/long/canary_pairs.hpp"

namespace hil::stress {

using namespace rtstdb;

namespace {

/// A large batch asks everything so often, so that it is divided and others commit in its gaps.
constexpr std::uint32_t max_repeats = 6;

constexpr double place_x_m(std::uint32_t place) {
  return 10.0 * place;
}
constexpr double pair_y_m(std::uint32_t pair) {
  return 4.0 * pair;
}
constexpr double half_z_m(std::uint32_t half) {
  return 2.0 * half;
}
/// Pairs whose masks are the same are far from one another.
constexpr std::uint32_t mask_of(std::uint32_t pair) {
  return 1u << (pair % 32);
}

EntityRow row_at(GeometryId body, std::uint32_t pair, std::uint32_t half, std::uint32_t place) {
  EntityRow row;
  row.geometry = body;
  row.mask = mask_of(pair);
  row.material = place;
  row.motion.p_world_m = {place_x_m(place), pair_y_m(pair), half_z_m(half)};
  return row;
}

template <class Query>
std::unique_ptr<Query> prepared(Result<std::unique_ptr<Query>> made) {
  if (!made) std::abort();
  return std::move(made).value();
}

}  // namespace

/// Asks about every pair in three ways, and judges what it hears.
class CanaryPairs::Reader {
 public:
  Reader(CanaryPairs& world, std::uint32_t seed)
      : world_(world),
        random_(seed),
        rays_(prepared(world.database_->prepare(
            RayQueryOptions{.name = "canary rays", .capacity = 2 * pairs * max_repeats}))),
        regions_(prepared(world.database_->prepare(RegionQueryOptions{
            .name = "canary regions", .capacity = pairs * places * max_repeats, .ids_per_region = 4}))),
        points_(prepared(world.database_->prepare(
            NearestQueryOptions{.name = "canary points", .capacity = pairs * max_repeats, .k = 2}))),
        transaction_(world.database_->make_transaction({.max_queries = 3})) {}

  void run() {
    while (!world_.over_.load(std::memory_order_relaxed)) {
      const std::uint32_t repeats = random_() % 3 == 0 ? max_repeats : 1;
      Terms terms;
      terms.read_at = read_at();
      terms.importance = static_cast<std::uint8_t>(random_() % 3);
      // Of a past time, whoever it is that holds then; a version may be asked ahead of its own time.
      const WorldTime t = terms.read_at.kind == ReadAt::Kind::time ? terms.read_at.time : ahead_;
      declare(repeats, t);
      transaction_->begin(terms);
      transaction_->add_query(*rays_, 2 * pairs * repeats);
      transaction_->add_query(*regions_, pairs * places * repeats);
      transaction_->add_query(*points_, pairs * repeats);
      const Outcome& outcome = world_.database_->execute(*transaction_);
      if (outcome.status == Status::bad_input && terms.read_at.kind != ReadAt::Kind::latest) {
        ++seen.too_old;
        continue;
      }
      if (!outcome.done() || outcome.truncated) {
        note(outcome, "an outcome that should not be: " + describe(outcome));
        continue;
      }
      ++seen.transactions;
      seen.of_the_past += terms.read_at.kind == ReadAt::Kind::latest ? 0 : 1;
      judge(outcome, repeats);
      const std::uint64_t questions = repeats * (2 * pairs + pairs * places + pairs);
      seen.questions += questions;
      world_.answered_.fetch_add(questions, std::memory_order_relaxed);
    }
  }

  Seen seen;
  std::vector<Read> reads;

 private:
  ReadAt read_at() {
    const VersionInfo latest = world_.database_->latest();
    // Writers take time on by microseconds; what is asked must not be before the version that comes to be
    // read.
    ahead_ = latest.time + Nanoseconds(100'000'000);
    const Version back = random_() % 200;
    switch (random_() % 4) {
      case 0:
        return ReadAt::pinned(
            std::max(latest.version - std::min(back, latest.version), world_.born_.version));
      case 1:
        return ReadAt::as_of(
            std::max(latest.time - Nanoseconds(static_cast<std::int64_t>(back) * 1000), world_.born_.time));
      default:
        return ReadAt::latest();
    }
  }

  void declare(std::uint32_t repeats, WorldTime t) {
    for (std::uint32_t k = 0; k < pairs * repeats; ++k) {
      const std::uint32_t pair = k % pairs;
      const auto y_m = static_cast<float>(pair_y_m(pair));
      for (std::uint32_t half = 0; half < 2; ++half) {
        Ray& ray = rays_->rays()[2 * k + half];
        ray = {};
        ray.origin_m = {-20.0f, y_m, static_cast<float>(half_z_m(half))};
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

  void note(const Outcome& outcome, const std::string& what) {
    if (seen.halves++ == 0) {
      std::ostringstream words;
      words << "version " << outcome.version << ": " << what;
      seen.first_half = words.str();
    }
    world_.over_.store(true);
  }

  /// Every question about a pair has to name one place, the same for all.
  void judge(const Outcome& outcome, std::uint32_t repeats) {
    std::array<std::int64_t, pairs> place_of;
    place_of.fill(-1);
    for (std::uint32_t k = 0; k < pairs * repeats; ++k) {
      const std::uint32_t pair = k % pairs;
      const auto agrees = [&](std::int64_t place, const char* by) {
        if (place_of[pair] < 0) place_of[pair] = place;
        if (place_of[pair] == place && place >= 0) return;
        std::ostringstream words;
        words << "pair " << pair << " stands at place " << place_of[pair] << " and, by " << by << ", at "
              << place;
        note(outcome, words.str());
      };
      for (std::uint32_t half = 0; half < 2; ++half)
        agrees(place_by_ray(rays_->hits()[2 * k + half], world_.entities_[2 * pair + half]),
               half == 0 ? "the first's ray" : "the second's ray");
      for (std::uint32_t place = 0; place < places; ++place) {
        const RegionAnswer& answer = regions_->answers()[k * places + place];
        const bool both = answer.found == 2 && answer.entities[0] == world_.entities_[2 * pair] &&
                          answer.entities[1] == world_.entities_[2 * pair + 1];
        if (both) {
          agrees(place, "a region with both");
        } else if (answer.found != 0 || place_of[pair] == place) {
          agrees(-2, "a region with less than both");
        }
      }
      for (std::uint32_t half = 0; half < 2; ++half)
        agrees(place_by_distance(points_->answers()[k], half),
               half == 0 ? "the nearest" : "the second nearest");
    }
    Read read{.version = outcome.version};
    std::ranges::transform(place_of, read.places.begin(),
                           [](std::int64_t place) { return static_cast<std::uint8_t>(place); });
    reads.push_back(read);
  }

  /// By what its row says, and where it is.
  static std::int64_t place_by_ray(const RayHit& hit, EntityId expected) {
    if (hit.status != HitStatus::hit || hit.entity != expected) return -3;
    const bool there = std::abs(static_cast<double>(hit.lambda) - (19.5 + place_x_m(hit.material))) < 1e-3;
    return there ? static_cast<std::int64_t>(hit.material) : -4;
  }

  static std::int64_t place_by_distance(const NearestAnswer& answer, std::uint32_t half) {
    if (answer.neighbors.size() != 2) return -5;
    const Neighbor& neighbor = answer.neighbors[half];
    const double beside_m = std::max(0.0, std::abs(place_x_m(neighbor.material) - 35.0) - 0.5);
    const double distance_m = std::hypot(beside_m, 0.5);
    return std::abs(static_cast<double>(neighbor.distance_m) - distance_m) < 1e-3
               ? static_cast<std::int64_t>(neighbor.material)
               : -6;
  }

  CanaryPairs& world_;
  std::minstd_rand random_;
  std::unique_ptr<RayQuery> rays_;
  std::unique_ptr<RegionQuery> regions_;
  std::unique_ptr<NearestQuery> points_;
  std::unique_ptr<Transaction> transaction_;
  WorldTime ahead_{};
};

/// Moves some pairs at a time. Some moves come too late, lose a race or are cancelled.
class CanaryPairs::Writer {
 public:
  Writer(CanaryPairs& world, std::uint32_t seed)
      : world_(world),
        random_(seed),
        transaction_(world.database_->make_transaction({.max_writes = 16, .max_preconditions = 1})) {}

  void run() {
    while (!world_.over_.load(std::memory_order_relaxed)) {
      Terms terms;
      terms.world_time = world_.database_->latest().time + Nanoseconds(1000);
      terms.importance = static_cast<std::uint8_t>(random_() % 3);
      if (random_() % 4 == 0) {
        terms.deadline_class = DeadlineClass::firm;
        terms.deadline = world_.now() + Nanoseconds(random_() % 300'000);
      }
      transaction_->begin(terms);
      const std::size_t made = moves.size();
      for (auto count = 1 + random_() % 4; count > 0; --count) {
        const auto pair = static_cast<std::uint32_t>(random_() % pairs);
        const auto place = static_cast<std::uint32_t>(random_() % places);
        for (std::uint32_t half = 0; half < 2; ++half)
          transaction_->update(world_.entities_[2 * pair + half], row_at(world_.body_, pair, half, place));
        moves.push_back({.pair = static_cast<std::uint8_t>(pair), .place = static_cast<std::uint8_t>(place)});
      }
      world_.database_->submit(*transaction_);
      if (random_() % 8 == 0) world_.database_->cancel(*transaction_);
      const Outcome& outcome = world_.database_->wait(*transaction_);
      for (std::size_t k = made; k < moves.size(); ++k)
        moves[k].version = outcome.version;
      if (!outcome.done()) {
        ++seen.came_to_nothing;
        moves.resize(made);
      }
      // So that readers come to read, and versions do not run out of memory before they do.
      std::this_thread::sleep_for(std::chrono::microseconds(random_() % 400));
    }
  }

  Seen seen;
  std::vector<Move> moves;

 private:
  CanaryPairs& world_;
  std::minstd_rand random_;
  std::unique_ptr<Transaction> transaction_;
};

ClockTime CanaryPairs::now() {
  return clock_time_ns(std::chrono::steady_clock::now().time_since_epoch().count());
}

std::string CanaryPairs::open() {
  DatabaseOptions options;
  if (const char* select = std::getenv("HIL_TEST_GPU"); select != nullptr) options.gpu = select;
  options.validation = Validation::off;
  options.max_entities = 256;
  options.retained_changes = 1u << 9;  // so that some of the past is gone
  options.chunk = Nanoseconds(200'000);
  auto opened = Database::open(options);
  if (!opened) return opened.error().message;
  database_ = std::move(opened).value();
  const auto body = database_->add_geometry(make_box({1.0, 1.0, 1.0}), "canary");
  if (!body) return body.error().message;
  body_ = body.value();
  const auto transaction = database_->make_transaction({.max_writes = 2 * pairs});
  transaction->begin({});
  for (std::uint32_t pair = 0; pair < pairs; ++pair) {
    for (std::uint32_t half = 0; half < 2; ++half)
      transaction->create(row_at(body_, pair, half, pair % places));
  }
  const Outcome& outcome = database_->execute(*transaction);
  if (!outcome.done()) return describe(outcome);
  for (std::uint32_t k = 0; k < 2 * pairs; ++k)
    entities_.push_back(transaction->created(k));
  for (std::uint32_t pair = 0; pair < pairs; ++pair)
    places_[pair] = pair % places;
  born_ = {outcome.version, outcome.version_time};
  return {};
}

void CanaryPairs::judge(std::vector<Read> reads, std::vector<Move> moves, Seen& seen) {
  std::ranges::stable_sort(reads, {}, &Read::version);
  std::ranges::stable_sort(moves, {}, &Move::version);  // those of one version stay in their order
  auto next = moves.begin();
  const auto go_to = [&](Version version) {
    for (; next != moves.end() && next->version <= version; ++next)
      places_[next->pair] = next->place;
  };
  for (const Read& read : reads) {
    go_to(read.version);
    if (read.places == places_ || seen.halves++ > 0) continue;
    const auto pair =
        static_cast<std::size_t>(std::ranges::mismatch(read.places, places_).in1 - read.places.begin());
    std::ostringstream words;
    words << "version " << read.version << ": pair " << pair << " was seen at place "
          << int{read.places[pair]} << " and stands at " << int{places_[pair]} << " there";
    seen.first_half = words.str();
  }
  go_to(std::numeric_limits<Version>::max());
}

CanaryPairs::Seen CanaryPairs::run(std::uint32_t seed, int readers, int writers, std::uint64_t questions) {
  over_ = false;
  answered_ = 0;
  const Version before = database_->latest().version;
  std::vector<std::unique_ptr<Reader>> reading;
  std::vector<std::unique_ptr<Writer>> writing;
  std::vector<std::thread> threads;
  reading.reserve(static_cast<std::size_t>(readers));
  writing.reserve(static_cast<std::size_t>(writers));
  threads.reserve(reading.capacity() + writing.capacity());
  for (int k = 0; k < readers; ++k)
    reading.push_back(std::make_unique<Reader>(*this, seed * 100 + static_cast<std::uint32_t>(k) + 1));
  for (int k = 0; k < writers; ++k)
    writing.push_back(std::make_unique<Writer>(*this, seed * 100 + static_cast<std::uint32_t>(k) + 51));
  for (const auto& reader : reading)
    threads.emplace_back([&reader] { reader->run(); });
  for (const auto& writer : writing)
    threads.emplace_back([&writer] { writer->run(); });
  // However the threads are scheduled, the world has moved meanwhile.
  constexpr Version min_versions = 50;
  while (!over_.load() &&
         (answered_.load() < questions || database_->latest().version < before + min_versions))
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  over_ = true;
  for (std::thread& thread : threads)
    thread.join();
  Seen all;
  const auto add = [&](const Seen& one) {
    all.questions += one.questions;
    all.transactions += one.transactions;
    all.of_the_past += one.of_the_past;
    all.too_old += one.too_old;
    all.came_to_nothing += one.came_to_nothing;
    if (all.halves == 0) all.first_half = one.first_half;
    all.halves += one.halves;
  };
  std::vector<Read> reads;
  std::vector<Move> moves;
  for (const auto& reader : reading) {
    add(reader->seen);
    reads.insert(reads.end(), reader->reads.begin(), reader->reads.end());
  }
  for (const auto& writer : writing) {
    add(writer->seen);
    moves.insert(moves.end(), writer->moves.begin(), writer->moves.end());
  }
  judge(std::move(reads), std::move(moves), all);
  all.versions = database_->latest().version - before;
  return all;
}

}  // namespace hil::stress
