#include "runtime/run/response_judge.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <utility>

namespace hil::run {
namespace {

constexpr std::uint64_t most_pending = 65536;
constexpr std::uint64_t most_kept = 1'000'000;  // room is made for all of them before the run
constexpr std::int64_t long_ago_ns = std::numeric_limits<std::int64_t>::min();

std::string milliseconds_text(std::int64_t time_ns) {
  char text[48];
  std::snprintf(text, sizeof text, "%.2f ms", static_cast<double>(time_ns) * 1e-6);
  return text;
}

}  // namespace

ResponseJudge::ResponseJudge(std::string name, const config::Response& claim,
                             const signals::SignalTable& table, const Arrivals& arrivals,
                             std::uint64_t most_samples)
    : name_(std::move(name)),
      arrivals_(arrivals),
      within_ns_(claim.within_ns),
      at_least_(claim.at_least),
      pending_(std::clamp<std::uint64_t>(most_samples, 1, most_pending)) {
  const auto side = [&](const std::string& signal_name) {
    const signals::SignalId signal = *table.find(signal_name);
    return Side{signal_name, signal, arrivals.keeps(signal), table.info(signal).initial, long_ago_ns};
  };
  requests_ = side(claim.request.text);
  replies_ = side(claim.reply.text);
  early_replies_.fill({.value = 0.0, .time_ns = long_ago_ns});
  samples_ns_.reserve(std::min(most_samples, most_kept));
}

template <typename Use>
void ResponseJudge::take(Side& side, const signals::SignalTable& table, std::span<const Arrival> arrived,
                         const Use& use) noexcept {
  if (side.one_by_one) {
    for (const Arrival& arrival : arrived) {
      if (arrival.signal == side.signal) use(Known{arrival.value, arrival.time_ns});
    }
    return;
  }
  const signals::SignalValue& latched = table.read(side.signal);
  if (!latched.fresh || latched.time_ns == side.last_ns) return;
  side.last_ns = latched.time_ns;
  if (std::exchange(side.last_value, latched.value) == latched.value) return;
  use(Known{latched.value, latched.time_ns});
}

void ResponseJudge::look(const signals::SignalTable& table, std::span<const Arrival> arrived,
                         std::int64_t /*time_ns*/) noexcept {
  take(requests_, table, arrived, [this](Known request) { add_request(request); });
  take(replies_, table, arrived, [this](Known reply) { take_reply(reply); });
}

report::Expectation ResponseJudge::result(std::int64_t end_ns) const {
  const std::string claim =
      requests_.name + " answered by " + replies_.name + " within " + milliseconds_text(within_ns_);
  const std::uint64_t unanswered = unanswered_by(end_ns);
  const std::uint64_t judged = answered_ + unanswered;
  std::string figures = std::to_string(judged) + " requests, " + std::to_string(unanswered) +
                        " unanswered, " + std::to_string(late_) + " late";
  if (answered_ > 0) figures += ", slowest " + milliseconds_text(slowest_ns_);
  if (!is_list_whole())
    figures += " (the list of times holds the first " + std::to_string(samples_ns_.size()) + ")";
  if (arrivals_.lost() > 0) {
    return {name_, false,
            claim + ": can not be judged, " + std::to_string(arrivals_.lost()) +
                " samples were lost between the bus and the tick; without them " + figures,
            first_failure(end_ns)};
  }
  if (judged < at_least_) {
    return {name_, false,
            claim + ": only " + figures + "; at least " + std::to_string(at_least_) + " are asked for",
            first_failure(end_ns)};
  }
  return {name_, unanswered == 0 && late_ == 0, claim + ": " + figures, first_failure(end_ns)};
}

std::optional<report::ResponseTime> ResponseJudge::response_times(std::int64_t end_ns) const {
  // What is told of the list under its name is told of all answers, unless it says otherwise.
  const std::string name =
      is_list_whole() ? name_ : name_ + " (the first " + std::to_string(samples_ns_.size()) + " answers)";
  return report::ResponseTime{name, within_ns_, samples_ns_, unanswered_by(end_ns)};
}

void ResponseJudge::add_request(Known request) noexcept {
  if (pending_count_ == pending_.size()) give_up_first(1);
  pending_[(first_ + pending_count_++) % pending_.size()] = request;
  Known* earliest = nullptr;
  for (Known& reply : early_replies_) {
    if (reply.value != request.value || reply.time_ns < request.time_ns) continue;
    if (earliest == nullptr || reply.time_ns < earliest->time_ns) earliest = &reply;
  }
  if (earliest != nullptr && answer(*earliest)) earliest->time_ns = long_ago_ns;
}

void ResponseJudge::take_reply(Known reply) noexcept {
  if (answer(reply)) return;
  early_replies_[next_early_] = reply;
  next_early_ = (next_early_ + 1) % early_replies_.size();
}

bool ResponseJudge::answer(Known reply) noexcept {
  for (std::size_t i = 0; i < pending_count_; ++i) {
    // What came before a request is no answer to it.
    if (waiting(i).value != reply.value || waiting(i).time_ns > reply.time_ns) continue;
    const std::int64_t took_ns = reply.time_ns - waiting(i).time_ns;
    give_up_first(i);  // an answer passes over older requests: those stay unanswered
    ++answered_;
    slowest_ns_ = std::max(slowest_ns_, took_ns);
    if (took_ns > within_ns_) {
      ++late_;
      note_failure(waiting(0).time_ns + within_ns_);
    }
    if (samples_ns_.size() < samples_ns_.capacity()) samples_ns_.push_back(took_ns);
    drop_first(1);
    return true;
  }
  return false;
}

void ResponseJudge::give_up_first(std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i)
    note_failure(waiting(i).time_ns + within_ns_);
  given_up_ += count;
  drop_first(count);
}

void ResponseJudge::drop_first(std::size_t count) noexcept {
  first_ = (first_ + count) % pending_.size();
  pending_count_ -= count;
}

void ResponseJudge::note_failure(std::int64_t time_ns) noexcept {
  if (!first_failure_ns_ || time_ns < *first_failure_ns_) first_failure_ns_ = time_ns;
}

std::uint64_t ResponseJudge::unanswered_by(std::int64_t end_ns) const {
  std::uint64_t count = given_up_;
  for (std::size_t i = 0; i < pending_count_; ++i)
    count += waiting(i).time_ns + within_ns_ <= end_ns ? 1 : 0;
  return count;
}

std::optional<std::int64_t> ResponseJudge::first_failure(std::int64_t end_ns) const {
  std::optional<std::int64_t> first = first_failure_ns_;
  for (std::size_t i = 0; i < pending_count_; ++i) {
    const std::int64_t due_ns = waiting(i).time_ns + within_ns_;
    if (due_ns <= end_ns && (!first || due_ns < *first)) first = due_ns;
  }
  return first;
}

}  // namespace hil::run
