#pragma once
// Signals, and expectations that are evaluated tick by tick.

#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <source_location>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "runtime/config/parse.hpp"
#include "runtime/expectations/count_judge.hpp"
#include "runtime/expectations/every_tick.hpp"
#include "runtime/expectations/kinds.hpp"
#include "runtime/expectations/reaction_judge.hpp"
#include "runtime/expectations/response_judge.hpp"

namespace hil::expectations {

inline constexpr std::int64_t ms = 1'000'000;
using Result = report::ExpectationResult;

inline config::Expression condition(const std::string& text) {
  config::Diagnostics diagnostics;
  const auto value = config::parse_text("test", '"' + text + '"', config::Schema::text(), diagnostics);
  auto parsed = config::Expression::parse(value.value(), diagnostics);
  if (!parsed) throw std::runtime_error(diagnostics.to_text());
  return std::move(*parsed);
}

class Expectations : public ::testing::Test {
 protected:
  signals::SignalTable table_;
  const signals::SignalId speed_ = table_.add({.name = "ego.speed", .unit = "m/s", .writer = "ego"});
  const signals::SignalId request_ = table_.add({.name = "bus.Header.Counter", .unit = "", .writer = "bus"});
  const signals::SignalId reply_ = table_.add({.name = "bus.Command.AnswerTo", .unit = "", .writer = "bus"});

  Arrivals arrivals_;  ///< empty unless a test keeps arrivals of inputs

  template <class Data>
  std::unique_ptr<Judge> judge(Data claim, std::uint64_t duration_ticks = 1000) {
    return judge_of_expectation({.name = "claim", .place = {}, .claim = claim_of(std::move(claim))},
                                duration_ticks);
  }
  template <class Data>
  std::unique_ptr<Judge> windowed(Data claim, const config::WindowSection& window) {
    return judge_of_expectation(
        {.name = "claim", .place = {}, .window = window, .claim = claim_of(std::move(claim))});
  }
  std::unique_ptr<Judge> judge_of_expectation(const config::Expectation& expectation,
                                              std::uint64_t duration_ticks = 1000) {
    return make_judge({.expectation = expectation,
                       .table = table_,
                       .arrivals = arrivals_,
                       .duration_ticks = duration_ticks,
                       .options = {.period_ns = ms, .seed = 0}});
  }
  std::unique_ptr<Judge> responses(std::int64_t within_ns, std::uint64_t at_least = 1,
                                   std::uint64_t duration_ticks = 1000) {
    return judge(Response{.request = {"bus.Header.Counter", {}},
                          .reply = {"bus.Command.AnswerTo", {}},
                          .within_ns = within_ns,
                          .at_least = at_least},
                 duration_ticks);
  }
  /// Checks the result, and that its detail contains each of the words.
  static report::Expectation expect(const Judge& judge, const Extent& extent, Result expected,
                                    std::initializer_list<const char*> words = {},
                                    const std::source_location& at = std::source_location::current()) {
    const ::testing::ScopedTrace trace(at.file_name(), static_cast<int>(at.line()), "expected here");
    report::Expectation result = judge.result(extent);
    EXPECT_EQ(result.result, expected) << result.detail;
    for (const char* word : words)
      EXPECT_NE(result.detail.find(word), std::string::npos) << result.detail;
    return result;
  }
  static Extent until(std::int64_t end_ns, std::uint64_t ticks = 1) { return {end_ns, ticks, ms}; }

  /// Judges the frames that arrived, then the tick.
  void tick(const std::vector<Judge*>& judges, std::int64_t time_ns) {
    for (const Arrival& frame : arrivals_.collect()) {
      arrivals_.set_current(frame);
      for (Judge* const judge : judges)
        judge->check(table_, {.time_ns = frame.time_ns, .is_tick = false});
    }
    for (Judge* const judge : judges)
      judge->check(table_, {.time_ns = time_ns});
  }

  void set_speed(Judge& judge, double speed, std::int64_t time_ns) {
    table_.write(speed_, speed, time_ns);
    judge.check(table_, {.time_ns = time_ns});
  }
  void request(Judge& judge, double value, std::int64_t time_ns) {
    table_.write(request_, value, time_ns);
    judge.check(table_, {.time_ns = time_ns});
  }
  void reply(Judge& judge, double value, std::int64_t time_ns) {
    table_.write(reply_, value, time_ns);
    judge.check(table_, {.time_ns = time_ns});
  }
};

}  // namespace hil::expectations
