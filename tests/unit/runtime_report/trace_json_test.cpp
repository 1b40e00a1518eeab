#include "runtime/report/trace_json.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <limits>
#include <sstream>

#include "hostile_text.hpp"
#include "runtime/report/text_safety.hpp"

namespace hil::report {
namespace {

std::string written(const TraceRecord& trace) {
  std::ostringstream out;
  write_trace_json(out, trace);
  return out.str();
}

TEST(TraceJson, HasNamedRowsSpansAndInstants) {
  const TraceRecord trace{
      "hil crossing",
      {{"base tick"}, {"scanner"}},
      {{0, 17, 17'000'123, 41'007, ""}, {1, 17, 17'000'200, 5'000'000, "slice"}},
      {{1, 27'000'000, "deadline miss: database"}, {TraceInstant::whole_run, -5, "light turns red"}}};
  const auto json = nlohmann::json::parse(written(trace));
  EXPECT_EQ(json.at("displayTimeUnit"), "ns");
  const auto& events = json.at("traceEvents");
  ASSERT_EQ(events.size(), 1U + 2 * 2 + 2 + 2);
  EXPECT_EQ(events.at(1).at("args").at("name"), "base tick");
  const auto& span = events.at(5);
  EXPECT_EQ(span.at("ph"), "X");
  EXPECT_EQ(span.at("name"), "base tick");
  EXPECT_DOUBLE_EQ(span.at("ts"), 17'000.123);
  EXPECT_DOUBLE_EQ(span.at("dur"), 41.007);
  EXPECT_EQ(span.at("args").at("tick"), 17);
  EXPECT_EQ(events.at(6).at("name"), "slice");
  EXPECT_EQ(events.at(6).at("tid"), events.at(3).at("tid")) << "a span has the row of its track";
  EXPECT_EQ(events.at(7).at("ph"), "i");
  EXPECT_EQ(events.at(7).at("s"), "t");
  EXPECT_EQ(events.at(8).at("s"), "g");
  EXPECT_DOUBLE_EQ(events.at(8).at("ts"), -0.005);
}

TEST(TraceJson, WritesNanosecondsExactly) {
  const TraceRecord trace{
      "",
      {{"t"}},
      {{0, 0, std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min(), ""}},
      {}};
  const std::string text = written(trace);
  EXPECT_NE(text.find("\"ts\":9223372036854775.807"), std::string::npos);
  EXPECT_NE(text.find("\"dur\":-9223372036854775.808"), std::string::npos);
}

TEST(TraceJson, IsJsonForEmptyAndHostileTraces) {
  EXPECT_EQ(nlohmann::json::parse(written({})).at("traceEvents").size(), 1U);
  TraceRecord trace;
  for (const std::string& text : test::hostile_texts()) {
    trace.tracks.push_back({text});
    trace.instants.push_back({TraceInstant::whole_run, 0, text});
  }
  const std::string text = written(trace);
  EXPECT_EQ(valid_utf8(text), text);
  EXPECT_EQ(nlohmann::json::parse(text).at("traceEvents").size(), 1U + 3 * trace.tracks.size());
}

TEST(TraceJsonDeathTest, UnknownTrackIsMisuse) {
  const TraceRecord trace{"", {{"only"}}, {{1, 0, 0, 0, ""}}, {}};
  EXPECT_DEATH(written(trace), "track 1 of 1");
}

}  // namespace
}  // namespace hil::report
