#include "runtime/expectations/response_judge.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <utility>

#include "runtime/config/reading.hpp"
#include "runtime/config/shared_schemas.hpp"
#include "runtime/expectations/time_text.hpp"
#include "runtime/expectations/window.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::expectations {
namespace {

constexpr std::uint64_t max_pending = 65536;
constexpr std::uint64_t max_kept = 1'000'000;  // allocated before the run
constexpr std::int64_t long_ago_ns = std::numeric_limits<std::int64_t>::min();

std::string milliseconds_text(std::int64_t time_ns) {
  char text[48];
  std::snprintf(text, sizeof text, "%.2f ms", static_cast<double>(time_ns) * 1e-6);
  return text;
}

/// What a request is on the buses that keep all values of a signal. Empty: on no type.
std::string meaning_of_request(std::span<const config::BusSectionType> buses) {
  std::string text;
  for (const config::BusSectionType& type : buses) {
    if (!type.arrival_noun.empty())
      text += " Of a signal on a " + type.noun + ", each " + type.arrival_noun + " is a request.";
  }
  return text;
}

config::Schema response_schema(std::span<const config::BusSectionType> buses) {
  using config::Field;
  using config::Schema;
  return Schema::record({
      Field::needed("request", Schema::signal(),
                    "The signal whose changes are requests." + meaning_of_request(buses)),
      Field::needed("reply", Schema::signal(), "The signal that replies by taking the value of the request."),
      Field::needed("within", config::duration_schema(config::min_duration_s),
                    "The longest time from a request to its reply."),
      Field::with_default(
          "at_least", Schema::integer(1, 1'000'000'000), "1",
          "The least number of requests that have to be judged. With fewer, the expectation is not checked."),
  });
}

std::shared_ptr<const config::Claim> read_response(const config::Value& entry,
                                                   const config::ClaimContext& context) {
  const config::Value& value = entry["response"];
  check_within(value["within"], entry, context);
  if (value["request"].text() == value["reply"].text()) {
    context.diagnostics.add(value["reply"].place(),
                            "'reply': " + config::in_quotes(value["reply"].text()) +
                                " is the request itself; the reply is another signal");
  }
  return claim_of(Response{config::word_of(value["request"]), config::word_of(value["reply"]),
                           value["within"].duration_ns(),
                           static_cast<std::uint64_t>(value["at_least"].integer())});
}

}  // namespace

void check_claim(const Response& claim, const ClaimCheck& check) {
  check.known.find(claim.request, check.diagnostics);
  check.known.find(claim.reply, check.diagnostics);
}

std::vector<signals::SignalId> judged_arrivals_of(const Response& claim, const signals::SignalTable& table) {
  return {*table.find(claim.request.text), *table.find(claim.reply.text)};
}

std::unique_ptr<Judge> judge_of(const Response& claim, const JudgeContext& context) {
  return std::make_unique<ResponseJudge>(claim, context);
}
PlotContent plot_content_of(const Response& claim, const signals::SignalTable& table) {
  PlotContent content = plot_of(*table.find(claim.request.text));
  content.add(*table.find(claim.reply.text));
  return content;
}

config::ExpectationKind response_kind() {
  return {.key = "response",
          .about = "One signal replies to another in time.",
          .schema = response_schema,
          .read = read_response};
}

ResponseJudge::ResponseJudge(const Response& claim, const JudgeContext& context)
    : name_(context.expectation.name),
      arrivals_(context.arrivals),
      coverage_({*context.table.find(claim.request.text)}, context.table, context.arrivals,
                context.expectation),
      reply_connected_(context.table.find(context.table.info(*context.table.find(claim.reply.text)).writer +
                                          ".connected")),
      within_ns_(claim.within_ns),
      at_least_(claim.at_least),
      pending_(std::clamp<std::uint64_t>(context.max_instants(), 1, max_pending)) {
  const auto side = [&](const std::string& signal_name) {
    const signals::SignalId signal = *context.table.find(signal_name);
    return Side{signal_name, signal, arrivals_.keeps(signal), context.table.info(signal).initial,
                long_ago_ns};
  };
  requests_ = side(claim.request.text);
  replies_ = side(claim.reply.text);
  early_replies_.fill({.value = 0.0, .time_ns = long_ago_ns});
  times_ns_.reserve(std::min(context.max_instants(), max_kept));
}

std::optional<ResponseJudge::Reply> ResponseJudge::change_of(Side& side,
                                                             const signals::SignalTable& table) noexcept {
  const signals::SignalValue& latched = table.read(side.signal);
  if (side.has_arrivals || !latched.fresh || latched.time_ns == side.last_ns) return std::nullopt;
  side.last_ns = latched.time_ns;
  if (std::exchange(side.last_value, latched.value) == latched.value) return std::nullopt;
  return Reply{.value = latched.value, .time_ns = latched.time_ns};
}

std::optional<ResponseJudge::Reply> ResponseJudge::arrived_at(Side& side, const signals::SignalTable& table,
                                                              signals::Instant instant) const noexcept {
  if (instant.is_tick) return change_of(side, table);
  const auto value = side.has_arrivals ? arrivals_.current().find(side.signal) : std::nullopt;
  if (!value) return std::nullopt;
  return Reply{.value = *value, .time_ns = arrivals_.current().time_ns};
}

bool ResponseJudge::take(const signals::SignalTable& table, signals::Instant instant,
                         bool is_judged) noexcept {
  const auto request = arrived_at(requests_, table, instant);
  if (request) add_request({*request, coverage_.evaluated_ticks(), is_judged});
  if (const auto reply = arrived_at(replies_, table, instant)) take_reply(*reply);
  return request.has_value();
}

void ResponseJudge::check(const signals::SignalTable& table, signals::Instant instant) noexcept {
  was_checked_ = true;
  take(table, instant, true);
  if (!instant.is_tick) return;
  if (reply_connected_ && table.value(*reply_connected_) == 0.0) mark_disconnected(instant.time_ns);
  // A request without a time-out may be rare: its absence does not reduce the coverage.
  const bool may_be_rare = table.info(requests_.signal).timeout_ns == 0;
  coverage_.check(table, instant, may_be_rare || table.is_known(requests_.signal));
}

void ResponseJudge::skip(const signals::SignalTable& table, signals::Instant instant) noexcept {
  if (was_checked_) return;  // after the window nothing is matched
  take(table, instant, false);
  if (!instant.is_tick) return;
  if (reply_connected_ && table.value(*reply_connected_) == 0.0) mark_disconnected(instant.time_ns);
}

void ResponseJudge::check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                                   bool in_gap) noexcept {
  const bool has_request = take(table, instant, false);
  if (instant.is_tick && reply_connected_ && table.value(*reply_connected_) == 0.0)
    mark_disconnected(instant.time_ns);
  if (has_request)
    coverage_.check_unplaced(table, instant, in_gap);
  else
    coverage_.check(table, instant, true);
}

std::string ResponseJudge::figures(const Unanswered& unanswered) const {
  std::string text = std::to_string(answered_ + unanswered.judged) + " requests, " +
                     std::to_string(unanswered.judged) + " unanswered, " + std::to_string(late_) + " late";
  if (answered_ > 0) text += ", slowest " + milliseconds_text(slowest_ns_);
  if (unanswered.disconnected > 0)
    text += "; " + counted(unanswered.disconnected, "further request", "further requests") +
            " not judged, since the replying device was not connected";
  if (unanswered.cut_off > 0)
    text += "; " + counted(unanswered.cut_off, "further request", "further requests") +
            " not judged, since the run or the window ended before their time limit";
  if (!has_all_times()) text += " (the list of times has the first " + std::to_string(times_ns_.size()) + ")";
  return text;
}

report::Expectation ResponseJudge::result(const Extent& extent) const {
  const std::string claim =
      requests_.name + " answered by " + replies_.name + " within " + milliseconds_text(within_ns_) + ": ";
  const Unanswered unanswered = unanswered_by(extent.end_ns);
  const std::uint64_t judged = answered_ + unanswered.judged;
  const std::uint64_t could_be_judged = judged + unanswered.disconnected;
  const std::string seen = figures(unanswered);
  const std::optional<PendingBegin> pending = oldest_pending(extent.end_ns);
  const std::string shortfall = coverage_.shortfall(extent.ticks, pending);
  report::Expectation result = held_result(name_, coverage_, extent, pending);
  result.result = report::ExpectationResult::not_checked;
  result.first_failure_ns = first_failure(extent.end_ns);
  if (unanswered.judged > 0) {
    result.worst_ns = result.first_failure_ns;  // without a reply there is no margin
  } else if (answered_ > 0) {
    result.margin = static_cast<double>(within_ns_ - slowest_ns_) / 1e9;
    result.margin_unit = "s";
    result.worst_ns = slowest_request_ns_;
  }
  if (arrivals_.lost() > 0) {
    result.detail = claim + "can not be judged, " + arrivals_.lost_text() + "; without them " + seen;
  } else if (unanswered.judged > 0 || late_ > 0) {
    result.result = report::ExpectationResult::failed;
    result.detail = claim + seen;
  } else if (judged < at_least_) {
    result.detail = claim + "only " + seen + "; at least " + std::to_string(at_least_) + " are required";
  } else if (!coverage_.suffices(judged, could_be_judged)) {
    result.detail =
        claim + "judged " + coverage_.share_text(judged, could_be_judged, "requests") + "; " + seen;
  } else if (!shortfall.empty()) {
    result.detail = claim + seen + ", and " + shortfall;
  } else {
    result.result = report::ExpectationResult::held;
    result.detail = claim + seen;
  }
  return result;
}

std::optional<report::ResponseTime> ResponseJudge::response_times(std::int64_t end_ns) const {
  // The name tells when the list lacks answers.
  const std::string name =
      has_all_times() ? name_ : name_ + " (the first " + std::to_string(times_ns_.size()) + " answers)";
  const Unanswered unanswered = unanswered_by(end_ns);
  return report::ResponseTime{.name = name,
                              .limit_ns = within_ns_,
                              .samples_ns = times_ns_,
                              .unanswered = unanswered.judged,
                              .not_judged = unanswered.disconnected + unanswered.cut_off};
}

void ResponseJudge::add_request(Request request) noexcept {
  if (pending_count_ == pending_.size()) count_first_as_unanswered(1);
  pending_[(first_ + pending_count_++) % pending_.size()] = request;
  Reply* earliest = nullptr;
  for (Reply& reply : early_replies_) {
    if (reply.value != request.value || reply.time_ns <= request.time_ns) continue;
    if (earliest == nullptr || reply.time_ns < earliest->time_ns) earliest = &reply;
  }
  if (earliest != nullptr && answer(*earliest)) earliest->time_ns = long_ago_ns;
}

void ResponseJudge::take_reply(Reply reply) noexcept {
  if (answer(reply)) return;
  early_replies_[next_early_] = reply;
  next_early_ = (next_early_ + 1) % early_replies_.size();
}

bool ResponseJudge::answer(Reply reply) noexcept {
  for (std::size_t i = 0; i < pending_count_; ++i) {
    // A reply before a request does not answer it.
    if (waiting(i).value != reply.value || waiting(i).time_ns > reply.time_ns) continue;
    const std::int64_t took_ns = reply.time_ns - waiting(i).time_ns;
    count_first_as_unanswered(i);  // older requests stay unanswered
    if (!waiting(0).is_judged) {
      drop_first(1);
      return true;
    }
    ++answered_;
    if (answered_ == 1 || took_ns > slowest_ns_) {
      slowest_ns_ = took_ns;
      slowest_request_ns_ = waiting(0).time_ns;
    }
    if (took_ns > within_ns_ && !waiting(0).disconnected) {
      ++late_;
      note_failure(waiting(0).time_ns + within_ns_);
    }
    if (times_ns_.size() < times_ns_.capacity()) times_ns_.push_back(took_ns);
    drop_first(1);
    return true;
  }
  return false;
}

/// The replying device is not connected: marks the requests before their time limit.
void ResponseJudge::mark_disconnected(std::int64_t time_ns) noexcept {
  for (std::size_t i = pending_count_; i-- > 0;) {
    Request& request = pending_[(first_ + i) % pending_.size()];
    if (request.disconnected || request.time_ns + within_ns_ < time_ns) return;  // older ones likewise
    request.disconnected = true;
  }
}

void ResponseJudge::count_first_as_unanswered(std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    if (!waiting(i).is_judged) continue;
    if (waiting(i).disconnected) {
      ++unanswered_disconnected_;
    } else {
      note_failure(waiting(i).time_ns + within_ns_);
      ++unanswered_;
    }
  }
  drop_first(count);
}

void ResponseJudge::drop_first(std::size_t count) noexcept {
  first_ = (first_ + count) % pending_.size();
  pending_count_ -= count;
}

void ResponseJudge::note_failure(std::int64_t time_ns) noexcept {
  if (!first_failure_ns_ || time_ns < *first_failure_ns_) first_failure_ns_ = time_ns;
}

ResponseJudge::Unanswered ResponseJudge::unanswered_by(std::int64_t end_ns) const {
  Unanswered count{.judged = unanswered_, .disconnected = unanswered_disconnected_, .cut_off = 0};
  for (std::size_t i = 0; i < pending_count_; ++i) {
    const Request& request = waiting(i);
    if (!request.is_judged) continue;
    ++(request.disconnected                    ? count.disconnected
       : request.time_ns + within_ns_ < end_ns ? count.judged
                                               : count.cut_off);
  }
  return count;
}

std::optional<PendingBegin> ResponseJudge::oldest_pending(std::int64_t end_ns) const {
  for (std::size_t i = 0; i < pending_count_; ++i) {
    const Request& request = waiting(i);
    if (!request.is_judged || request.disconnected || request.time_ns + within_ns_ < end_ns) continue;
    return PendingBegin{request.time_ns, request.evaluated_before};
  }
  return std::nullopt;
}

std::optional<std::int64_t> ResponseJudge::first_failure(std::int64_t end_ns) const {
  std::optional<std::int64_t> first = first_failure_ns_;
  for (std::size_t i = 0; i < pending_count_; ++i) {
    const std::int64_t due_ns = waiting(i).time_ns + within_ns_;
    if (waiting(i).is_judged && !waiting(i).disconnected && due_ns < end_ns && (!first || due_ns < *first))
      first = due_ns;
  }
  return first;
}

}  // namespace hil::expectations
