#pragma once
// Which beams a step of a laser scanner covers: those that leave between its release and the next one, a
// slice of a sweep. Sweeps follow one another from the first release on. When releases are skipped, slices
// are missing, and the sweep is not complete.
//
// Times are nanoseconds of run time. Threads: one.

#include <cstdint>

#include "runtime/modules/laser_scanner/scan_pattern.hpp"

namespace hil::modules {

class SweepClock {
 public:
  /// `pattern` outlives it.
  explicit SweepClock(const ScanPattern& pattern) : pattern_(pattern) {}

  /// The first sweep begins then. Before the first advance().
  void set_first_release(std::int64_t first_release_ns) noexcept { first_release_ns_ = first_release_ns; }
  /// Goes to the slice from `release_ns` to `release_ns` + `step_ns`. True: it is the first one of its sweep,
  /// or those before it are missing. A sweep is a whole number of steps.
  bool advance(std::int64_t release_ns, std::int64_t step_ns) noexcept {
    const std::int64_t period_ns = pattern_.options().period_ns;
    const std::int64_t offset_ns = (release_ns - first_release_ns_) % period_ns;
    const std::uint64_t first_beam = pattern_.first_beam_at(offset_ns);
    const bool begins_sweep = sweeps_ == 0 || release_ns - offset_ns != sweep_begin_ns_;
    if (begins_sweep) {
      sweep_begin_ns_ = release_ns - offset_ns;
      ++sweeps_;
      has_answers_ = false;
      is_complete_ = offset_ns == 0;
    } else if (first_beam != end_beam_) {
      is_complete_ = false;
    }
    first_beam_ = first_beam;
    end_beam_ = pattern_.first_beam_at(offset_ns + step_ns);
    return begins_sweep;
  }

  std::int64_t first_release_ns() const noexcept { return first_release_ns_; }
  /// The number of sweeps of which a slice was reached.
  std::uint64_t sweeps() const noexcept { return sweeps_; }

  // Of the current slice: the beams [first_beam, end_beam), of the sweep that begins at sweep_begin_ns.
  std::int64_t sweep_begin_ns() const noexcept { return sweep_begin_ns_; }
  /// The number of the sweep, counted from the first release, with the sweeps that were skipped.
  std::int64_t sweep_number() const noexcept {
    return (sweep_begin_ns_ - first_release_ns_) / pattern_.options().period_ns;
  }
  std::uint64_t first_beam() const noexcept { return first_beam_; }
  std::uint64_t end_beam() const noexcept { return end_beam_; }
  std::uint32_t beam_count() const noexcept { return static_cast<std::uint32_t>(end_beam_ - first_beam_); }
  std::int64_t beam_time_ns(std::uint64_t beam) const noexcept {
    return sweep_begin_ns_ + pattern_.time_ns(beam);
  }
  bool ends_sweep() const noexcept { return end_beam_ == pattern_.beams(); }

  /// The beams of the current slice were traced.
  void note_answers() noexcept { has_answers_ = true; }
  /// They were not, or not in each way that the scanner needs.
  void note_missing_answers() noexcept { is_complete_ = false; }
  /// A slice of the sweep was traced.
  bool has_answers() const noexcept { return has_answers_; }
  /// No slice of the sweep so far is missing, and no answers are.
  bool is_complete() const noexcept { return is_complete_; }

 private:
  const ScanPattern& pattern_;
  std::int64_t first_release_ns_ = 0;
  std::int64_t sweep_begin_ns_ = 0;
  std::uint64_t first_beam_ = 0, end_beam_ = 0;
  std::uint64_t sweeps_ = 0;
  bool has_answers_ = false;
  bool is_complete_ = false;
};

}  // namespace hil::modules
