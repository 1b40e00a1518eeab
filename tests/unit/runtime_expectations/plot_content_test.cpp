// What the plot of an expectation shows.

#include "runtime/expectations/plot_content.hpp"

#include "judged_signals.hpp"
#include "runtime/expectations/statistics.hpp"

namespace hil::expectations {
namespace {

class PlotContentOf : public Expectations {
 protected:
  std::vector<double> limits(const std::string& text) const {
    PlotContent content;
    content.add(condition(text), table_);
    std::vector<double> values;
    for (const PlotLimit& limit : content.limits)
      values.push_back(limit.value);
    return values;
  }
};

TEST_F(PlotContentOf, ConditionHasEachSignalOnce) {
  PlotContent content;
  content.add(condition("ego.speed > 1 m/s and abs(ego.speed) < 2 m/s or bus.Header.Counter == 3"), table_);
  EXPECT_EQ(content.signals, (std::vector<signals::SignalId>{speed_, request_}));
}

TEST_F(PlotContentOf, ComparisonWithAConstantHasALimit) {
  EXPECT_EQ(limits("ego.speed > 36 km/h"), std::vector<double>{10.0});
  EXPECT_EQ(limits("3 <= ego.speed"), std::vector<double>{3.0});
  EXPECT_EQ(limits("ego.speed < 2 * 3 m/s"), std::vector<double>{6.0});
  EXPECT_EQ(limits("not (ego.speed < -1 m/s)"), std::vector<double>{-1.0});
  EXPECT_EQ(limits("ego.speed > 1 m/s and (ego.speed < 2 m/s or bus.Header.Counter < 7)"),
            (std::vector<double>{1.0, 2.0, 7.0}));
}

TEST_F(PlotContentOf, OtherOperandsHaveNone) {
  for (const char* text : {"ego.speed == 3 m/s", "ego.speed / 2 > 1 m/s", "abs(ego.speed) < 1 m/s",
                           "bus.Header.Counter > bus.Command.AnswerTo", "ego.speed > 1 m/s / 0"})
    EXPECT_TRUE(limits(text).empty()) << text;
}

TEST_F(PlotContentOf, WindowAddsTheSignalsOfItsConditions) {
  config::WindowSection window{};
  window.after = condition("bus.Header.Counter > 2");
  const PlotContent found = plot_content({.name = "claim",
                                          .place = {},
                                          .window = window,
                                          .claim = claim_of(Always{condition("ego.speed > 1 m/s")})},
                                         table_);
  EXPECT_EQ(found.signals, (std::vector<signals::SignalId>{speed_, request_}));
}

TEST_F(PlotContentOf, StatisticsHaveNoLimitsOfTheSignal) {
  Statistics claim{.signal = {"ego.speed", {}}, .limits = {}, .overshoot = {}, .settling = {}};
  claim.limits[Statistics::mean].max = condition("18 km/h");
  claim.limits[Statistics::smallest].min = condition("1 m/s");
  const PlotContent found =
      plot_content({.name = "claim", .place = {}, .claim = claim_of(std::move(claim))}, table_);
  EXPECT_EQ(found.signals, std::vector{speed_});
  EXPECT_TRUE(found.limits.empty());
}

TEST_F(PlotContentOf, ReactionsAndResponsesHaveBothSides) {
  const auto signals_of = [&](auto claim) {
    return plot_content({.name = "claim", .place = {}, .claim = claim_of(std::move(claim))}, table_).signals;
  };
  EXPECT_EQ(signals_of(Reaction{.when = condition("ego.speed > 1 m/s"),
                                .then = condition("bus.Header.Counter == 1"),
                                .within_ns = ms}),
            (std::vector<signals::SignalId>{speed_, request_}));
  EXPECT_EQ(
      signals_of(Response{
          .request = {"bus.Header.Counter", {}}, .reply = {"bus.Command.AnswerTo", {}}, .within_ns = ms}),
      (std::vector<signals::SignalId>{request_, reply_}));
  EXPECT_EQ(
      signals_of(Order{.conditions = {condition("ego.speed > 1 m/s"), condition("bus.Header.Counter == 1")}}),
      (std::vector<signals::SignalId>{speed_, request_}));
}

}  // namespace
}  // namespace hil::expectations
