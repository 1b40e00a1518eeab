#pragma once
// Whether tasks read the values of a stimulus.
//
// Threads: one at a time; nothing allocates but the constructor.

#include <cstddef>
#include <optional>
#include <vector>

#include "runtime/signals/signal_table.hpp"

namespace hil::injection {

class StimulusEffect final : public signals::ReadObserver {
 public:
  /// `parts`: of its sequence.
  explicit StimulusEffect(std::size_t parts) : parts_(parts) {}

  /// In each tick, before tasks read the value. `part`: of the sequence, of an active stimulus.
  void set(bool is_active, double value, std::size_t part) noexcept {
    if (is_active && !before_) before_ = value_;
    is_active_ = is_active;
    value_ = value;
    part_ = part;
    if (is_active && part < parts_.size()) parts_[part].has_begun = true;
  }
  /// After the end the signal keeps the last value, which is an effect where it is another one than before.
  void note_read(signals::ReadBy by) noexcept override {
    if (by != signals::ReadBy::task || !before_) return;
    took_effect_ |= is_active_ || value_ != *before_;
    if (is_active_ && part_ < parts_.size()) parts_[part_].was_read = true;
  }

  bool took_effect() const noexcept { return took_effect_; }
  /// Whether the part began, and no value of it was read.
  bool is_unread(std::size_t part) const noexcept { return parts_[part].has_begun && !parts_[part].was_read; }

 private:
  struct Part {
    bool has_begun = false, was_read = false;
  };
  std::vector<Part> parts_;
  bool is_active_ = false;
  double value_ = 0.0;
  std::optional<double> before_{};  ///< the value before the first begin
  std::size_t part_ = 0;
  bool took_effect_ = false;
};

}  // namespace hil::injection
