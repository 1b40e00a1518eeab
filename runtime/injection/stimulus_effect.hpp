#pragma once
// Whether tasks read the values of a stimulus.
//
// Threads: one at a time; nothing allocates but the constructor.

#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
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
    if (std::isnan(value_)) {
      was_unknown_ = true;
      return;
    }
    took_effect_ |= is_active_ || value_ != *before_;
    if (is_active_ && part_ < parts_.size()) parts_[part_].was_read = true;
  }
  void note_replaced(std::string_view fault) noexcept override {
    if (!is_active_) return;
    replaced_by_ = fault;
    if (part_ < parts_.size()) parts_[part_].replaced_by = fault;
  }

  bool took_effect() const noexcept { return took_effect_; }
  /// Whether a task read it while its value was unknown.
  bool was_unknown() const noexcept { return was_unknown_; }
  bool has_begun(std::size_t part) const noexcept { return parts_[part].has_begun; }
  bool was_read(std::size_t part) const noexcept { return parts_[part].was_read; }
  /// The fault that replaced a value that would have been read; empty: none.
  std::string_view replaced_by() const noexcept { return replaced_by_; }
  std::string_view replaced_by(std::size_t part) const noexcept { return parts_[part].replaced_by; }

 private:
  struct Part {
    bool has_begun = false, was_read = false;
    std::string_view replaced_by{};
  };
  std::vector<Part> parts_;
  bool is_active_ = false;
  double value_ = 0.0;
  std::optional<double> before_{};  ///< the value before the first begin
  std::size_t part_ = 0;
  bool took_effect_ = false, was_unknown_ = false;
  std::string_view replaced_by_{};
};

}  // namespace hil::injection
