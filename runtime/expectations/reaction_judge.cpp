#include "runtime/expectations/reaction_judge.hpp"

#include <algorithm>

#include "runtime/config/shared_schemas.hpp"
#include "runtime/expectations/time_text.hpp"
#include "runtime/expectations/window.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::expectations {
namespace {

constexpr std::uint64_t max_open = 65'536;
constexpr std::uint64_t max_kept_times = 1'000'000;

config::Schema reaction_schema(std::span<const config::BusSectionType> /*buses*/) {
  using config::Field;
  using config::Schema;
  return Schema::record({
      Field::needed("when", Schema::text(), "A condition: a reaction begins where it becomes true."),
      Field::needed("then", Schema::text(), "The condition that has to be true in time."),
      Field::needed("within", config::duration_schema(config::min_duration_s),
                    "The longest time from 'when' to 'then'."),
      Field::optional("for_at_least", config::duration_schema(config::min_duration_s),
                      "How long 'then' has to stay true. Left out: one instant suffices."),
      Field::with_default("at_least", Schema::integer(1, 1'000'000'000), "1",
                          "The least number of reactions that have to be judged. With fewer, the expectation "
                          "is not checked."),
  });
}

std::shared_ptr<const config::Claim> read_reaction(const config::Value& entry,
                                                   const config::ClaimContext& context) {
  const config::Value& value = entry["reaction"];
  check_within(value["within"], entry, context);
  auto when = config::Expression::parse(value["when"], context.diagnostics);
  auto then = config::Expression::parse(value["then"], context.diagnostics);
  if (!when || !then) return nullptr;
  return claim_of(Reaction{std::move(*when), std::move(*then), value["within"].duration_ns(),
                           static_cast<std::uint64_t>(value["at_least"].integer()),
                           value.has("for_at_least") ? value["for_at_least"].duration_ns() : 0});
}

}  // namespace

void check_claim(const Reaction& claim, const ClaimCheck& check) {
  check.condition(claim.when);
  check.condition(claim.then);
  // One that has to stay true may be the condition itself: its pulses are long enough.
  if (claim.hold_ns == 0) check.different(claim.when, claim.then, "each reaction is in time");
}

std::vector<signals::SignalId> judged_arrivals_of(const Reaction& claim, const signals::SignalTable& table) {
  return plot_content_of(claim, table).signals;
}
std::unique_ptr<Judge> judge_of(const Reaction& claim, const JudgeContext& context) {
  return std::make_unique<ReactionJudge>(claim, context);
}
PlotContent plot_content_of(const Reaction& claim, const signals::SignalTable& table) {
  PlotContent content = plot_of(claim.when, table);
  content.add(claim.then, table);
  return content;
}

config::ExpectationKind reaction_kind() {
  return {.key = "reaction",
          .about = "Each time that one condition becomes true, another one is true in time.",
          .schema = reaction_schema,
          .read = read_reaction};
}

ReactionJudge::ReactionJudge(const Reaction& claim, const JudgeContext& context)
    : name_(context.expectation.name),
      conditions_{{claim.when, context.table, context.options},
                  {claim.then,
                   context.table,
                   {.period_ns = context.options.period_ns, .seed = ~context.options.seed}}},
      coverage_(signals_of(conditions_), context.table, context.arrivals, context.expectation),
      within_ns_(claim.within_ns),
      at_least_(claim.at_least),
      hold_ns_(claim.hold_ns),
      open_(std::min(max_open, max_at_once(claim, context))) {
  times_ns_.reserve(std::min(context.max_instants(), max_kept_times));
}

std::uint64_t ReactionJudge::max_at_once(const Reaction& claim, const JudgeContext& context) {
  if (context.judges_frames) return max_open;
  // A condition becomes true at most at each second instant.
  return static_cast<std::uint64_t>((claim.within_ns + claim.hold_ns) / context.options.period_ns) / 2 + 2;
}

void ReactionJudge::begin(std::int64_t time_ns) noexcept {
  if (end_ - first_ == open_.size()) {
    ++first_;
    ++not_judged_;
  }
  open_[end_++ % open_.size()] = {.begin_ns = time_ns, .evaluated_before = coverage_.evaluated_ticks()};
}

void ReactionJudge::note_margin(std::int64_t begin_ns, std::int64_t margin_ns) noexcept {
  if (margin_ns >= margin_ns_) return;
  margin_ns_ = margin_ns;
  worst_begin_ns_ = begin_ns;
}

void ReactionJudge::complete(std::int64_t time_ns) noexcept {
  if (late_begin_ns_) {
    note_margin(*late_begin_ns_, within_ns_ - (*then_since_ns_ - *late_begin_ns_));
    late_begin_ns_.reset();
  }
  for (; first_ != end_; ++first_) {
    const std::int64_t begin_ns = oldest().begin_ns;
    const std::int64_t since_ns = std::max(begin_ns, *then_since_ns_);
    if (since_ns > begin_ns + within_ns_) {  // it can only be in time if `then` was true while it was unknown
      if (!may_be_in_time(oldest())) return;
      ++unknown_;
      continue;
    }
    if (time_ns - since_ns < hold_ns_) return;
    const std::int64_t took_ns = since_ns - begin_ns;
    ++in_time_;
    if (in_time_ == 1 || took_ns > slowest_ns_) {
      slowest_ns_ = took_ns;
      slowest_begin_ns_ = begin_ns;
    }
    note_margin(begin_ns, within_ns_ - took_ns);
    completed_begin_ns_ = begin_ns;
    completed_since_ns_ = since_ns;
    if (times_ns_.size() < times_ns_.capacity()) times_ns_.push_back(took_ns);
  }
}

void ReactionJudge::note_then_ended(std::int64_t time_ns) noexcept {
  if (!then_since_ns_) return;
  // The last completed reaction began last, so `then` stayed true for the shortest time after it.
  if (hold_ns_ > 0 && completed_since_ns_)
    note_margin(*completed_begin_ns_, then_last_ns_ - *completed_since_ns_ - hold_ns_);
  completed_since_ns_.reset();
  for (std::uint64_t i = first_; i != end_; ++i) {
    OpenReaction& reaction = open_[i % open_.size()];
    const std::int64_t since_ns = std::max(reaction.begin_ns, *then_since_ns_);
    const std::int64_t stayed_ns = then_last_ns_ - since_ns;
    if (since_ns > reaction.begin_ns + within_ns_ || stayed_ns <= reaction.stayed_ns) continue;
    reaction.came_ns = since_ns;
    reaction.stayed_ns = stayed_ns;
    reaction.ended_ns = time_ns;
  }
  then_since_ns_.reset();
}

bool ReactionJudge::may_be_in_time(const OpenReaction& reaction) const noexcept {
  const std::int64_t since_ns = std::max(reaction.begin_ns, *possible_since_ns_);
  return since_ns <= reaction.begin_ns + within_ns_ && possible_last_ns_ - since_ns >= hold_ns_;
}

void ReactionJudge::note_possible_then_ended() noexcept {
  if (!possible_since_ns_) return;
  for (std::uint64_t i = first_; i != end_; ++i) {
    OpenReaction& reaction = open_[i % open_.size()];
    reaction.may_be_in_time = reaction.may_be_in_time || may_be_in_time(reaction);
  }
  possible_since_ns_.reset();
}

void ReactionJudge::end_before(std::int64_t time_ns) noexcept {
  for (; first_ != end_ && oldest().begin_ns + within_ns_ < time_ns; ++first_) {
    const OpenReaction& reaction = oldest();
    const std::int64_t limit_ns = reaction.begin_ns + within_ns_;
    // `then` followed in time and is still true.
    if (then_since_ns_ && *then_since_ns_ <= limit_ns) return;
    const bool may_follow = possible_since_ns_ && *possible_since_ns_ <= limit_ns;
    if (may_follow && !may_be_in_time(reaction)) return;
    if (may_follow || reaction.may_be_in_time) {
      ++unknown_;
      continue;
    }
    if (reaction.stayed_ns >= 0) {
      if (too_short_++ == 0 || reaction.stayed_ns < shortest_.stayed_ns) shortest_ = reaction;
      note_margin(reaction.begin_ns, reaction.stayed_ns - hold_ns_);
    } else {
      ++late_;
      if (!late_begin_ns_) late_begin_ns_ = reaction.begin_ns;
    }
    if (!first_failure_ns_) first_failure_ns_ = std::max(limit_ns, reaction.ended_ns);
  }
}

void ReactionJudge::skip(const signals::SignalTable& table, signals::Instant instant) noexcept {
  for (WatchedCondition& condition : conditions_)
    condition.truth(table, instant);
}

void ReactionJudge::follow(std::int64_t time_ns, Truth then) noexcept {
  if (then != Truth::yes) note_then_ended(time_ns);
  if (then == Truth::no) {
    note_possible_then_ended();
  } else {
    if (!possible_since_ns_) possible_since_ns_ = time_ns;
    possible_last_ns_ = time_ns;
  }
  end_before(time_ns);  // the time of some may have ended in ticks that were skipped
}

void ReactionJudge::conclude(std::int64_t time_ns, Truth then) noexcept {
  if (then != Truth::yes) return end_before(time_ns + 1);
  if (!then_since_ns_) then_since_ns_ = time_ns;
  then_last_ns_ = time_ns;
  complete(time_ns);
}

void ReactionJudge::check(const signals::SignalTable& table, signals::Instant instant) noexcept {
  const Truth when = conditions_[0].truth(table, instant);
  const Truth then = conditions_[1].truth(table, instant);
  if (conditions_[0].became_true()) begin(instant.time_ns);
  follow(instant.time_ns, then);
  coverage_.check(table, instant, when != Truth::unknown && (then != Truth::unknown || first_ == end_));
  conclude(instant.time_ns, then);
}

void ReactionJudge::check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                                   bool in_gap) noexcept {
  const Truth when = conditions_[0].truth(table, instant);
  conditions_[1].truth(table, instant);
  follow(instant.time_ns, Truth::unknown);  // what is open at the end of the window is not judged
  if (conditions_[0].became_true())
    coverage_.check_unplaced(table, instant, in_gap);
  else if (first_ != end_)
    coverage_.check_unplaced(table, instant, false);
  else
    coverage_.check(table, instant, when != Truth::unknown);
  conclude(instant.time_ns, Truth::unknown);
}

std::string ReactionJudge::figures() const {
  std::string text = std::to_string(in_time_) + " of " +
                     counted(in_time_ + late_ + too_short_, "reaction", "reactions") + " in time" +
                     (hold_ns_ > 0 ? " and for long enough" : "");
  if (in_time_ > 0)
    text += ", the slowest after " + duration_text(slowest_ns_) + ", at " + instant_text(slowest_begin_ns_);
  if (too_short_ > 0) {
    text += "; " + std::to_string(too_short_) + " too short: " + (too_short_ > 1 ? "in the shortest, " : "") +
            "'then' became true after " + duration_text(shortest_.came_ns - shortest_.begin_ns) +
            " and stayed true for " + duration_text(shortest_.stayed_ns) + " instead of " +
            duration_text(hold_ns_) + ", at " + instant_text(shortest_.begin_ns);
  }
  if (too_short_ > 0 && late_ > 0) text += "; " + std::to_string(late_) + " came too late or not at all";
  const auto add_not_judged = [&](std::uint64_t count, const std::string& why) {
    if (count > 0) text += "; " + std::to_string(count) + " not judged, since " + why;
  };
  add_not_judged(unknown_, "'then' was unknown in that time");
  add_not_judged(end_ - first_, "the run or the window ended before");
  add_not_judged(not_judged_, "more than " + std::to_string(open_.size()) + " were open at once");
  return text;
}

report::Expectation ReactionJudge::result(const Extent& extent) const {
  const std::string claim = "when " + conditions_[0].text() + " then " + conditions_[1].text() + " within " +
                            duration_text(within_ns_) +
                            (hold_ns_ > 0 ? " for at least " + duration_text(hold_ns_) : "");
  const std::uint64_t failed = late_ + too_short_, judged = in_time_ + failed;
  std::optional<PendingBegin> pending;
  if (end_ > first_) {
    const OpenReaction& oldest = open_[first_ % open_.size()];
    pending = PendingBegin{oldest.begin_ns, oldest.evaluated_before};
  }
  report::Expectation result = held_result(name_, coverage_, extent, pending);
  result.result = report::ExpectationResult::not_checked;
  result.detail = claim + ": " + figures();
  result.first_failure_ns = first_failure_ns_;
  if (judged > 0) {
    const std::int64_t open_margin_ns =
        late_begin_ns_ ? within_ns_ - (extent.end_ns - *late_begin_ns_) : margin_ns_;
    const bool is_open = open_margin_ns < margin_ns_;
    result.margin = static_cast<double>(is_open ? open_margin_ns : margin_ns_) / 1e9;
    result.margin_unit = "s";
    result.worst_ns = is_open ? *late_begin_ns_ : worst_begin_ns_;
  }
  const std::string shortfall = coverage_.shortfall(extent.ticks, pending);
  const std::uint64_t could_be_judged = judged + unknown_ + not_judged_;
  if (failed > 0) {
    result.result = report::ExpectationResult::failed;
  } else if (judged < at_least_) {
    result.detail += "; at least " + std::to_string(at_least_) + " have to be judged";
  } else if (!coverage_.suffices(judged, could_be_judged)) {
    result.detail += ", so judged " + coverage_.share_text(judged, could_be_judged, "reactions");
  } else if (!shortfall.empty()) {
    result.detail += ", and " + shortfall;
  } else {
    result.result = report::ExpectationResult::held;
  }
  return result;
}

std::optional<report::ResponseTime> ReactionJudge::response_times(std::int64_t /*end_ns*/) const {
  const bool has_all = in_time_ == times_ns_.size();
  return report::ResponseTime{
      .name = has_all ? name_ : name_ + " (the first " + std::to_string(times_ns_.size()) + ")",
      .limit_ns = within_ns_,
      .samples_ns = times_ns_,
      .unanswered = late_ + too_short_,
      .not_judged = unknown_ + not_judged_ + (end_ - first_)};
}

}  // namespace hil::expectations
