#include "runtime/run/expectations.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "runtime/run/response_judge.hpp"

namespace hil::run {
namespace {

std::string seconds_text(std::int64_t time_ns) {
  char text[48];
  std::snprintf(text, sizeof text, "%.3f s", static_cast<double>(time_ns) * 1e-9);
  return text;
}

/// A condition with the few signals that it mentions.
class Watched {
 public:
  Watched(const config::Condition& condition, const signals::SignalTable& table)
      : text_(condition.text()),
        values_(condition.mentions().size()),
        bound_(condition.bind(indices(values_.size()), named_numbers(condition, table))) {
    for (const config::Word& word : condition.mentions())
      ids_.push_back(*table.find(word.text));
  }

  bool holds(const signals::SignalTable& table) noexcept {
    for (std::size_t i = 0; i < ids_.size(); ++i)
      values_[i] = table.value(ids_[i]);
    return bound_.holds(values_);
  }
  const std::string& text() const noexcept { return text_; }

 private:
  static std::vector<std::uint32_t> indices(std::size_t count) {
    std::vector<std::uint32_t> result(count);
    for (std::size_t i = 0; i < count; ++i)
      result[i] = static_cast<std::uint32_t>(i);
    return result;
  }

  static std::vector<double> named_numbers(const config::Condition& condition,
                                           const signals::SignalTable& table) {
    std::vector<double> numbers;
    for (const config::Condition::NamedValue& value : condition.named_values()) {
      const signals::SignalId signal = *table.find(condition.mentions()[value.mention].text);
      numbers.push_back(table.info(signal).named_values.at(value.name.text));
    }
    return numbers;
  }

  std::string text_;
  std::vector<signals::SignalId> ids_;
  std::vector<double> values_;
  config::BoundCondition bound_;
};

class AtEveryTick final : public Judge {
 public:
  AtEveryTick(std::string name, const config::Condition& condition, bool wanted,
              const signals::SignalTable& table)
      : name_(std::move(name)), watched_(condition, table), wanted_(wanted) {}

  void look(const signals::SignalTable& table, std::span<const Arrival> /*arrived*/,
            std::int64_t time_ns) noexcept override {
    ++ticks_;
    if (!first_failure_ns_ && watched_.holds(table) != wanted_) first_failure_ns_ = time_ns;
  }

  report::Expectation result(std::int64_t /*end_ns*/) const override {
    const char* claim = wanted_ ? "always " : "never ";
    if (ticks_ == 0)
      return {name_, false, claim + watched_.text() + ": the run had no tick to judge", std::nullopt};
    if (first_failure_ns_) {
      return {name_, false, claim + watched_.text() + ": broken at " + seconds_text(*first_failure_ns_),
              first_failure_ns_};
    }
    return {name_, true, claim + watched_.text() + ": held for " + std::to_string(ticks_) + " ticks",
            std::nullopt};
  }

 private:
  const std::string name_;
  Watched watched_;
  const bool wanted_;
  std::uint64_t ticks_ = 0;
  std::optional<std::int64_t> first_failure_ns_;
};

class Once final : public Judge {
 public:
  Once(std::string name, const config::Eventually& claim, const signals::SignalTable& table)
      : name_(std::move(name)), watched_(claim.condition, table), by_ns_(claim.by_ns) {}

  void look(const signals::SignalTable& table, std::span<const Arrival> /*arrived*/,
            std::int64_t time_ns) noexcept override {
    if (!met_ns_ && watched_.holds(table)) met_ns_ = time_ns;
  }

  report::Expectation result(std::int64_t end_ns) const override {
    const std::string claim = "eventually " + watched_.text();
    const std::int64_t limit_ns = std::min(by_ns_.value_or(end_ns), end_ns);
    if (!met_ns_) return {name_, false, claim + ": not in " + seconds_text(limit_ns), limit_ns};
    if (by_ns_ && *met_ns_ > *by_ns_) {
      return {name_, false,
              claim + ": only at " + seconds_text(*met_ns_) + ", wanted by " + seconds_text(*by_ns_),
              *by_ns_};
    }
    return {name_, true, claim + ": at " + seconds_text(*met_ns_), std::nullopt};
  }

 private:
  const std::string name_;
  Watched watched_;
  const std::optional<std::int64_t> by_ns_;
  std::optional<std::int64_t> met_ns_;
};

}  // namespace

std::unique_ptr<Judge> make_judge(const config::Expectation& expectation, const signals::SignalTable& table,
                                  const Arrivals& arrivals, std::uint64_t most_samples) {
  if (const auto* never = std::get_if<config::Never>(&expectation.claim)) {
    return std::make_unique<AtEveryTick>(expectation.name, never->condition, false, table);
  }
  if (const auto* always = std::get_if<config::Always>(&expectation.claim)) {
    return std::make_unique<AtEveryTick>(expectation.name, always->condition, true, table);
  }
  if (const auto* eventually = std::get_if<config::Eventually>(&expectation.claim)) {
    return std::make_unique<Once>(expectation.name, *eventually, table);
  }
  return std::make_unique<ResponseJudge>(expectation.name, std::get<config::Response>(expectation.claim),
                                         table, arrivals, most_samples);
}

}  // namespace hil::run
