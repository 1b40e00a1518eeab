#include "bench/transactions/log_bandwidth.hpp"

#include <memory>
#include <stdexcept>
#include <string>

#include "bench/spatial/side_by_side.hpp"
#include "bench/transactions/folder.hpp"
#include "bench/transactions/plain_file.hpp"
#include "rtstdb/log/log_start.hpp"
#include "rtstdb/log/posix_disk.hpp"
#include "rtstdb/log/record.hpp"
#include "rtstdb/log/recovery.hpp"
#include "rtstdb/log/ring.hpp"
#include "rtstdb/log/writer.hpp"
#include "rtstdb/transaction/monotonic_clock.hpp"

namespace hil::bench {
namespace {

namespace log = rtstdb::log;

constexpr std::uint32_t rows_per_commit = 480;  // 61 kB

/// Without checkpoints.
class NoWorld final : public log::WorldSource {
 public:
  std::optional<log::WorldHead> begin(rtstdb::Version) override { return std::nullopt; }
  bool rows(std::uint32_t, std::span<rtstdb::EntityState>) override { return false; }
  bool shape(rtstdb::GeometryId, Shape&) override { return false; }
  void end() noexcept override {}
};

rtstdb::store::WriteSet some_commit() {
  rtstdb::store::WriteSet set;
  set.writes.resize(rows_per_commit);
  for (std::uint32_t k = 0; k < rows_per_commit; ++k) {
    set.writes[k].kind = rtstdb::store::WriteKind::update_motion;
    set.writes[k].state.id = {k, 1};
    set.writes[k].state.row.motion.p_world_m.x = k;
  }
  return set;
}

/// A log writer that the bench calls directly, on a disk of the machine.
class WriterByHand {
 public:
  explicit WriterByHand(const std::filesystem::path& directory)
      : disk_(take(log::open_directory(directory))), set_(some_commit()) {
    const log::Recovered nothing = must(log::recover(*disk_));
    writer_ = must(log::Writer::start(
        *disk_, clock_, ring_, no_world_,
        {.segment_bytes = rtstdb::DurabilityOptions{}.segment_bytes, .checkpoint_every_bytes = 0},
        log::start_after(nothing, log::new_database_id())));
  }

  /// Puts this many commits into the ring.
  void put(std::uint32_t commits) {
    const log::CommitEncoding form = log::encoding_of(set_, {});
    for (std::uint32_t k = 0; k < commits; ++k) {
      ++set_.version;
      log::encode_commit(set_, form, ring_.reserve(form.bytes));
      ring_.commit();
    }
  }
  /// Writes them to disk in one group.
  void write() {
    writer_->step(0);
    if (writer_->durable() != set_.version)
      throw std::runtime_error("log_bandwidth: " + writer_->statistics().last_fault);
  }
  std::uint64_t bytes_on_disk() const { return writer_->statistics().bytes; }

 private:
  static std::unique_ptr<log::Disk> take(log::DiskResult<std::unique_ptr<log::Disk>> opened) {
    if (!opened) throw std::runtime_error(opened.error().describe());
    return std::move(opened.value());
  }

  log::Ring ring_{rtstdb::DurabilityOptions{}.ring_bytes};
  std::unique_ptr<log::Disk> disk_;
  rtstdb::transaction::MonotonicClock clock_;
  NoWorld no_world_;
  rtstdb::store::WriteSet set_;
  std::unique_ptr<log::Writer> writer_;
};

Figure bandwidth(const std::string& name, std::uint32_t commits_per_group, int groups_per_round, int rounds) {
  const Folder folder;
  WriterByHand ours(folder.path() / "log");
  ours.put(commits_per_group);
  ours.write();
  const std::uint64_t group_bytes = ours.bytes_on_disk();
  // Not zeros, since disks may handle zeros faster.
  const std::vector<std::byte> piece(group_bytes, std::byte{0x5a});
  const auto groups = static_cast<std::uint64_t>(groups_per_round);

  std::vector<double> our_rates, their_rates;
  for (int round = 0; round < rounds; ++round) {
    const std::filesystem::path path = folder.path() / ("plain." + std::to_string(round));
    PlainFile theirs(path, groups * group_bytes);
    double ours_s = 0.0, theirs_s = 0.0;
    for (int group = 0; group < groups_per_round; ++group) {
      ours.put(commits_per_group);
      const RoundTimes times = once_each(
          group % 2 == 0, [&] { ours.write(); }, [&] { theirs.append(piece); });
      ours_s += times.ours_s.front();
      theirs_s += times.theirs_s.front();
    }
    std::filesystem::remove(path);
    const double megabytes = 1e-6 * static_cast<double>(groups * group_bytes);
    our_rates.push_back(megabytes / ours_s);
    their_rates.push_back(megabytes / theirs_s);
  }
  if (ours.bytes_on_disk() != group_bytes * (1 + groups * static_cast<std::uint64_t>(rounds)))
    throw std::runtime_error(name + ": the groups are not of one size");
  return {name,
          median(our_rates),
          "MB/s",
          PlainFile::name,
          median(their_rates),
          Better::higher,
          groups * static_cast<std::uint64_t>(rounds)};
}

}  // namespace

std::vector<Figure> measure_log_bandwidth(const SuiteOptions& options) {
  const int rounds = options.tiny ? 1 : 15;
  const int share = options.tiny ? 16 : 1;
  return {bandwidth("log_bandwidth", 16, 16 / share, rounds),
          bandwidth("log_bandwidth_64_kB", 1, 128 / share, rounds),
          bandwidth("log_bandwidth_4_MB", 64, 16 / share, rounds)};
}

}  // namespace hil::bench
