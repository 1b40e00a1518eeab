#pragma once
// An engine with its log on a simulated disk, random transactions, and a model that keeps the state of every
// version.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <vector>

#include "rtstdb/transaction/commit_log.hpp"
#include "tests/support/simulation/disk.hpp"
#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {

using hil::tests::SimulatedDisk;
using log::DiskCall;

/// With a sanitizer, which is slow, only one in this many repetitions is executed.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr int one_in = 8;
#else
inline constexpr int one_in = 1;
#endif

/// Time limit for events that must happen eventually.
inline constexpr std::chrono::seconds event_limit{60};

/// For tests of each mode that has a log.
inline auto every_mode() {
  return testing::Values(DurabilityMode::async, DurabilityMode::group, DurabilityMode::sync);
}
inline std::string mode_name(const testing::TestParamInfo<DurabilityMode>& mode) {
  return to_string(mode.param);
}

/// The state of the world in a test: the entity at each index, and its last write.
struct Slot {
  std::uint32_t generation = 0;  ///< the last generation of the index
  bool exists = false;
  std::uint32_t mask = 0;
  Version written_by = 0;
  bool operator==(const Slot&) const = default;
};
using Image = std::vector<Slot>;

/// Clears the generations of removed entities, which a snapshot does not contain.
inline Image without_generations(Image image) {
  for (Slot& slot : image)
    if (!slot.exists) slot = {};
  return image;
}

inline std::string describe(const Image& image) {
  std::string text;
  for (std::size_t k = 0; k < image.size(); ++k) {
    if (!image[k].exists) continue;
    text += std::to_string(k) + "/" + std::to_string(image[k].generation) + "=" +
            std::to_string(image[k].mask) + "@" + std::to_string(image[k].written_by) + " ";
  }
  return text;
}

/// A row without geometry.
inline EntityRow body(std::uint32_t mask) {
  EntityRow row;
  row.mask = mask;
  return row;
}

/// A model of the database: the state of every version.
class Model {
 public:
  static constexpr std::uint32_t capacity = 24;

  /// Declares a random transaction: one to three writes.
  void declare(Transaction& transaction, std::mt19937_64& random);
  /// The declared transaction is committed as `version`.
  void commit(Version version);
  /// The declared transaction may be committed as `version`; the state now is that without it.
  void commit_in_doubt(Version version);
  /// The database was opened again at `version`.
  void continue_at(Version version);

  const Image& now() const { return now_; }
  bool knows(Version version) const { return images_.contains(version); }
  const Image& image(Version version) const { return images_.at(version); }
  /// The newest version up to `version` that is not in doubt.
  Version newest_up_to(Version version) const {
    Version newest = 0;
    for (const auto& [number, certain] : certain_)
      if (number <= version && certain) newest = number;
    return newest;
  }

 private:
  struct Op {
    enum class Kind : std::uint8_t { create, update, remove } kind = Kind::create;
    std::uint32_t index = 0, mask = 0;
  };
  Image after(Version version) const;

  std::uint32_t masks_ = 0;
  Image now_ = Image(capacity);
  std::vector<Op> declared_;
  std::map<Version, Image> images_{{0, Image(capacity)}};
  std::map<Version, bool> certain_{{0, true}};
};

struct LoggedEngineOptions {
  DurabilityMode mode = DurabilityMode::async;
  std::size_t ring_bytes = std::size_t{1} << 16;
  std::uint64_t segment_bytes = std::uint64_t{32} << 10;
  std::uint64_t checkpoint_every_bytes = std::uint64_t{8} << 10;
  Nanoseconds flush_interval{1'000'000};
  std::uint32_t retained_changes = 256;
};

/// With a small ring, segments and checkpoints, so that a short run has many disk operations.
inline LoggedEngineOptions small_options(DurabilityMode mode) {
  LoggedEngineOptions options;
  options.mode = mode;
  options.ring_bytes = 8192;
  options.segment_bytes = 8192;
  options.checkpoint_every_bytes = 6000;
  options.flush_interval = Nanoseconds(100'000);
  return options;
}

inline CommitLogOptions log_options(const LoggedEngineOptions& options) {
  CommitLogOptions made;
  made.durability.mode = options.mode;
  made.durability.ring_bytes = options.ring_bytes;
  made.durability.segment_bytes = options.segment_bytes;
  made.durability.checkpoint_every_bytes = options.checkpoint_every_bytes;
  made.durability.flush_interval = options.flush_interval;
  made.max_entities = Model::capacity;
  return made;
}

/// The disk must outlive the log.
inline Result<std::unique_ptr<CommitLog>> open_log(SimulatedDisk& disk, const CommitLogOptions& options) {
  return CommitLog::open(std::shared_ptr<log::Disk>(std::shared_ptr<void>(), &disk), options);
}

inline EngineOptions engine_options_for(const LoggedEngineOptions& options) {
  EngineOptions made = engine_options(64, Model::capacity, options.retained_changes);
  made.store.geometry_known = [](GeometryId id) { return !id.valid() || id.index == 0; };
  return made;
}

/// One engine with its log, from open to close.
class LoggedEngine {
 public:
  // The analyzer does not follow the engine's constructor.
  // NOLINTBEGIN(clang-analyzer-optin.cplusplus.UninitializedObject)
  /// Aborts the test if the disk does not allow it to open.
  LoggedEngine(SimulatedDisk& disk, const LoggedEngineOptions& options)
      : LoggedEngine(std::move(open_log(disk, log_options(options))).value(), options) {}
  LoggedEngine(std::unique_ptr<CommitLog> log, const LoggedEngineOptions& options)
      : engine(engine_options_for(options), executor, clock, std::move(log)) {}
  // NOLINTEND(clang-analyzer-optin.cplusplus.UninitializedObject)

  std::unique_ptr<Transaction> make() { return engine.make_transaction(options_for(4, 2, 1)); }
  const Outcome& execute(Transaction& transaction) {
    engine.submit(transaction);
    return engine.wait(transaction);
  }
  /// Submits a transaction that creates an entity with this mask.
  std::unique_ptr<Transaction> submit_create(std::uint32_t mask) {
    auto transaction = make();
    transaction->begin({});
    transaction->create(body(mask));
    engine.submit(*transaction);
    return transaction;
  }
  /// Executes one random transaction and reports its outcome to the model.
  const Outcome& commit(Model& model, std::mt19937_64& random, const Terms& given = {});
  CommitLog& log() { return *engine.log(); }
  Image image();

  SimulatedClock clock;
  SimulatedExecutor executor;
  Engine engine;

 private:
  std::unique_ptr<Transaction> transaction_ = make();
};

/// Blocks threads in one kind of disk operation until `open`. The disk may outlive it.
class DiskGate {
 public:
  DiskGate(SimulatedDisk& disk, DiskCall call) {
    disk.before_each([state = state_, call](DiskCall made) {
      if (made == call && state->closed.load()) {
        state->held.store(true);
        state->held.notify_all();
        state->closed.wait(true);
      }
    });
  }
  ~DiskGate() { open(); }
  DiskGate(const DiskGate&) = delete;
  DiskGate& operator=(const DiskGate&) = delete;

  void wait_until_held() { state_->held.wait(false); }
  void open() {
    state_->closed.store(false);
    state_->closed.notify_all();
  }

 private:
  struct State {
    std::atomic<bool> closed{true}, held{false};
  };
  const std::shared_ptr<State> state_ = std::make_shared<State>();
};

}  // namespace rtstdb::transaction::test
