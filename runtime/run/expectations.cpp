#include "runtime/run/expectations.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

namespace hil::run {
namespace {

std::string seconds_text(std::int64_t time_ns) {
  char text[48];
  std::snprintf(text, sizeof text, "%.3f s", static_cast<double>(time_ns) * 1e-9);
  return text;
}

std::string milliseconds_text(std::int64_t time_ns) {
  char text[48];
  std::snprintf(text, sizeof text, "%.2f ms", static_cast<double>(time_ns) * 1e-6);
  return text;
}

/// A condition with the few signals that it mentions.
class Watched {
 public:
  Watched(const config::Condition& condition, const signals::SignalTable& table)
      : text_(condition.text()),
        values_(condition.mentions().size()),
        bound_(condition.bind(indices(values_.size()))) {
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

  void look(const signals::SignalTable& table, std::int64_t time_ns) noexcept override {
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

  void look(const signals::SignalTable& table, std::int64_t time_ns) noexcept override {
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

class Responses final : public Judge {
 public:
  Responses(std::string name, const config::Response& claim, const signals::SignalTable& table,
            std::uint64_t most_samples)
      : name_(std::move(name)),
        request_name_(claim.request.text),
        reply_name_(claim.reply.text),
        request_(*table.find(claim.request.text)),
        reply_(*table.find(claim.reply.text)),
        within_ns_(claim.within_ns),
        at_least_(claim.at_least),
        pending_(std::clamp<std::uint64_t>(most_samples, 1, most_pending)) {
    samples_ns_.reserve(most_samples);
  }

  void look(const signals::SignalTable& table, std::int64_t /*time_ns*/) noexcept override {
    const signals::SignalValue& request = table.read(request_);
    if (request.fresh && request.time_ns != last_request_ns_) {
      last_request_ns_ = request.time_ns;
      add_request({request.value, request.time_ns});
    }
    const signals::SignalValue& reply = table.read(reply_);
    if (reply.fresh && reply.time_ns != last_reply_ns_) {
      last_reply_ns_ = reply.time_ns;
      take_reply(reply.value, reply.time_ns);
    }
  }

  report::Expectation result(std::int64_t end_ns) const override {
    const std::string claim =
        request_name_ + " answered by " + reply_name_ + " within " + milliseconds_text(within_ns_);
    const std::uint64_t unanswered = unanswered_by(end_ns);
    const std::uint64_t judged = answered_ + unanswered;
    std::string figures = std::to_string(judged) + " requests, " + std::to_string(unanswered) +
                          " unanswered, " + std::to_string(late_) + " late";
    if (answered_ > 0) figures += ", slowest " + milliseconds_text(slowest_ns_);
    if (judged < at_least_) {
      return {name_, false,
              claim + ": only " + figures + "; at least " + std::to_string(at_least_) + " are asked for",
              first_failure(end_ns)};
    }
    return {name_, unanswered == 0 && late_ == 0, claim + ": " + figures, first_failure(end_ns)};
  }

  std::optional<report::ResponseTime> response_times(std::int64_t end_ns) const override {
    return report::ResponseTime{name_, within_ns_, samples_ns_, unanswered_by(end_ns)};
  }

 private:
  struct Request {
    double value = 0.0;
    std::int64_t time_ns = 0;
  };
  static constexpr std::uint64_t most_pending = 65536;

  /// The i-th oldest that waits.
  const Request& waiting(std::size_t i) const noexcept { return pending_[(first_ + i) % pending_.size()]; }

  void add_request(Request request) noexcept {
    if (pending_count_ == pending_.size()) give_up_first(1);
    pending_[(first_ + pending_count_++) % pending_.size()] = request;
  }

  void take_reply(double value, std::int64_t time_ns) noexcept {
    for (std::size_t i = 0; i < pending_count_; ++i) {
      // What came before a request is no answer to it.
      if (waiting(i).value != value || waiting(i).time_ns > time_ns) continue;
      const std::int64_t took_ns = time_ns - waiting(i).time_ns;
      give_up_first(i);  // an answer passes over older requests: those stay unanswered
      ++answered_;
      slowest_ns_ = std::max(slowest_ns_, took_ns);
      if (took_ns > within_ns_) {
        ++late_;
        note_failure(waiting(0).time_ns + within_ns_);
      }
      if (samples_ns_.size() < samples_ns_.capacity()) samples_ns_.push_back(took_ns);
      drop_first(1);
      return;
    }
  }

  void give_up_first(std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; ++i)
      note_failure(waiting(i).time_ns + within_ns_);
    lost_ += count;
    drop_first(count);
  }

  void drop_first(std::size_t count) noexcept {
    first_ = (first_ + count) % pending_.size();
    pending_count_ -= count;
  }

  void note_failure(std::int64_t time_ns) noexcept {
    if (!first_failure_ns_ || time_ns < *first_failure_ns_) first_failure_ns_ = time_ns;
  }

  std::uint64_t unanswered_by(std::int64_t end_ns) const {
    std::uint64_t count = lost_;
    for (std::size_t i = 0; i < pending_count_; ++i)
      count += waiting(i).time_ns + within_ns_ <= end_ns ? 1 : 0;
    return count;
  }

  std::optional<std::int64_t> first_failure(std::int64_t end_ns) const {
    std::optional<std::int64_t> first = first_failure_ns_;
    for (std::size_t i = 0; i < pending_count_; ++i) {
      const std::int64_t due_ns = waiting(i).time_ns + within_ns_;
      if (due_ns <= end_ns && (!first || due_ns < *first)) first = due_ns;
    }
    return first;
  }

  const std::string name_, request_name_, reply_name_;
  const signals::SignalId request_, reply_;
  const std::int64_t within_ns_;
  const std::uint64_t at_least_;
  std::int64_t last_request_ns_ = std::numeric_limits<std::int64_t>::min();
  std::int64_t last_reply_ns_ = std::numeric_limits<std::int64_t>::min();
  std::vector<Request> pending_;  // a ring
  std::size_t first_ = 0, pending_count_ = 0;
  std::uint64_t answered_ = 0, late_ = 0, lost_ = 0;
  std::int64_t slowest_ns_ = 0;
  std::optional<std::int64_t> first_failure_ns_;
  std::vector<std::int64_t> samples_ns_;
};

}  // namespace

std::unique_ptr<Judge> make_judge(const config::Expectation& expectation, const signals::SignalTable& table,
                                  std::uint64_t most_samples) {
  if (const auto* never = std::get_if<config::Never>(&expectation.claim)) {
    return std::make_unique<AtEveryTick>(expectation.name, never->condition, false, table);
  }
  if (const auto* always = std::get_if<config::Always>(&expectation.claim)) {
    return std::make_unique<AtEveryTick>(expectation.name, always->condition, true, table);
  }
  if (const auto* eventually = std::get_if<config::Eventually>(&expectation.claim)) {
    return std::make_unique<Once>(expectation.name, *eventually, table);
  }
  return std::make_unique<Responses>(expectation.name, std::get<config::Response>(expectation.claim), table,
                                     most_samples);
}

}  // namespace hil::run
