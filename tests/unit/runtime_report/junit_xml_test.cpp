#include "runtime/report/junit_xml.hpp"

#include <gtest/gtest.h>

#include "hostile_text.hpp"
#include "runtime/report/text_safety.hpp"
#include "sample_record.hpp"
#include "strict_xml.hpp"

namespace hil::report {
namespace {

using test::parse_strictly;
using test::XmlElement;

const XmlElement& case_named(const XmlElement& document, const std::string& name) {
  for (const XmlElement* element : document.all("testcase")) {
    if (element->attributes.at("name") == name) return *element;
  }
  throw std::runtime_error("no test case " + name);
}

TEST(JunitXml, HasACaseForEachExpectationAndTwoForTheRun) {
  const XmlElement document = parse_strictly(junit_xml(test::full_record()));
  EXPECT_EQ(document.name, "testsuites");
  EXPECT_EQ(document.all("testcase").size(), 6U);
  EXPECT_EQ(document.attributes.at("tests"), "6");
  EXPECT_EQ(document.attributes.at("failures"), "3");
  EXPECT_EQ(document.attributes.at("errors"), "0");
  EXPECT_EQ(document.attributes.at("time"), "10.021");
  const XmlElement& failed = case_named(document, "no collision");
  ASSERT_EQ(failed.children.size(), 2U);
  EXPECT_EQ(failed.children.at(0).name, "failure");
  EXPECT_EQ(failed.children.at(1).name, "system-out");
  EXPECT_EQ(failed.children.at(1).text, "margin -0.25 m at 8.420 s");
  EXPECT_NE(failed.children.at(0).text.find("first at 8.412 s"), std::string::npos);
  EXPECT_TRUE(case_named(document, "DUT answers within 50 ms").children.empty());
}

TEST(JunitXml, FailsForInputsThatDidNotCome) {
  RunRecord record;
  record.buses = {{.list_key = "can", .title = "CAN", .name_key = "bus", .buses = {{.name = "car"}}}};
  EXPECT_TRUE(
      case_named(parse_strictly(junit_xml(record)), "inputs came and were accepted").children.empty());
  record.input_failures = {"no value of message can.car.Speed came", "no value of message can.car.Yaw came"};
  const XmlElement document = parse_strictly(junit_xml(record));
  EXPECT_EQ(document.attributes.at("failures"), "1");
  EXPECT_EQ(document.attributes.at("tests"), "3");
  const XmlElement& failed = case_named(document, "inputs came and were accepted");
  ASSERT_EQ(failed.children.size(), 1U);
  EXPECT_EQ(failed.children.at(0).name, "failure");
  EXPECT_EQ(failed.children.at(0).text,
            "no value of message can.car.Speed came\nno value of message can.car.Yaw came\n");
}

TEST(JunitXml, OfARefusedScenarioHasOneErrorWithAllMistakes) {
  const XmlElement document =
      parse_strictly(refusal_junit_xml("s <1>", "s.yaml:1:1: a & b\ns.yaml:2:1: \x01c\n"));
  EXPECT_EQ(document.attributes.at("tests"), "1");
  EXPECT_EQ(document.attributes.at("errors"), "1");
  EXPECT_EQ(document.attributes.at("failures"), "0");
  EXPECT_EQ(document.all("testcase").size(), 1U);
  EXPECT_EQ(document.all("error").size(), 1U);
  const XmlElement& error = case_named(document, "run completed").children.at(0);
  EXPECT_EQ(error.attributes.at("message"), "s.yaml:1:1: a & b");
  EXPECT_NE(error.text.find("s.yaml:2:1: "), std::string::npos);
}

TEST(JunitXml, FailsForStimuliAndFaultsWithoutEffect) {
  RunRecord record;
  record.stimuli = {{.name = "surge", .target = "tank.inflow", .effect = "", .begins = 1}};
  EXPECT_TRUE(
      case_named(parse_strictly(junit_xml(record)), "stimuli and faults took effect").children.empty());
  record.faults = {{.name = "stuck", .target = "tank.level", .effect = ""},
                   {.name = "lost",
                    .target = "can.car.Status",
                    .effect = "",
                    .begins = 1,
                    .spans = {{.begin_ns = 3'000'200'000, .end_ns = 4'000'000'000}},
                    .frames = 0,
                    .took_effect = false,
                    .missing_effect = "no frame came"}};
  const XmlElement document = parse_strictly(junit_xml(record));
  EXPECT_EQ(document.attributes.at("failures"), "1");
  EXPECT_EQ(document.attributes.at("tests"), "3");
  const XmlElement& failed = case_named(document, "stimuli and faults took effect");
  ASSERT_EQ(failed.children.size(), 1U);
  EXPECT_EQ(failed.children.at(0).name, "failure");
  EXPECT_NE(failed.children.at(0).text.find("fault 'stuck' never began"), std::string::npos);
  EXPECT_NE(failed.children.at(0).text.find(
                "fault 'lost' was active from 3.0002 s to 4 s, but no frame came, so the"),
            std::string::npos);
}

TEST(JunitXml, ReportsPermittedMissesWithoutAFailure) {
  const XmlElement document = parse_strictly(junit_xml(test::full_record()));
  const XmlElement& timing = case_named(document, "timing not broken");
  ASSERT_EQ(timing.children.size(), 1U);
  EXPECT_EQ(timing.children.at(0).name, "system-out");
  EXPECT_NE(timing.children.at(0).text.find("20 of 10000 ticks skipped (0.2 %)"), std::string::npos);
  EXPECT_NE(timing.children.at(0).text.find("tick 3117, late by 402 us: late wake-up"), std::string::npos);
}

TEST(JunitXml, CasesHaveTheRunTimeOfTheirDecision) {
  RunRecord record;
  record.run_time_ns = 10'000'000'000;
  record.wall_ns = 10'021'000'000;
  Expectation failed{.name = "failed", .result = ExpectationResult::failed, .detail = {}};
  failed.first_failure_ns = 8'412'000'000;
  Expectation early{.name = "early", .result = ExpectationResult::held, .detail = {}};
  early.met_ns = 250'000'000;
  const Expectation held{.name = "held", .result = ExpectationResult::held, .detail = {}};
  record.expectations = {failed, early, held};
  const XmlElement document = parse_strictly(junit_xml(record));
  for (const auto& [name, time] : {std::pair{"failed", "8.412"},
                                   {"early", "0.250"},
                                   {"held", "10.000"},
                                   {"run completed", "10.000"},
                                   {"timing not broken", "10.000"}})
    EXPECT_EQ(case_named(document, name).attributes.at("time"), time) << name;
  EXPECT_EQ(document.attributes.at("time"), "10.021") << "the suite has the wall time";
}

TEST(JunitXml, CountsAndElementsAgreeForEveryVerdict) {
  for (const Verdict verdict : {Verdict::passed, Verdict::failed, Verdict::timing_broken, Verdict::io_failed,
                                Verdict::gpu_failed, Verdict::interrupted, Verdict::refused}) {
    RunRecord record = test::full_record();
    record.verdict = verdict;
    const XmlElement document = parse_strictly(junit_xml(record));
    EXPECT_EQ(std::to_string(document.all("failure").size()), document.attributes.at("failures"));
    EXPECT_EQ(std::to_string(document.all("error").size()), document.attributes.at("errors"));
    const bool broken = verdict == Verdict::io_failed || verdict == Verdict::gpu_failed ||
                        verdict == Verdict::interrupted || verdict == Verdict::refused;
    EXPECT_EQ(document.all("error").size(), broken ? 1U : 0U);
    const bool late = verdict == Verdict::timing_broken;
    EXPECT_EQ(case_named(document, "timing not broken").all("failure").size(), late ? 1U : 0U);
  }
}

TEST(JunitXml, EscapesAnyBytes) {
  RunRecord record;
  for (const std::string& text : test::hostile_texts())
    record.expectations.push_back({text, ExpectationResult::failed, text, std::nullopt});
  record.scenario.name = test::hostile_texts().front();
  const XmlElement document = parse_strictly(junit_xml(record));
  const auto cases = document.all("testcase");
  ASSERT_EQ(cases.size(), record.expectations.size() + 2);
  for (std::size_t index = 0; index < record.expectations.size(); ++index) {
    EXPECT_EQ(cases.at(index)->attributes.at("name"), clean_text(record.expectations.at(index).name));
    EXPECT_EQ(cases.at(index)->children.at(0).text,
              clean_text(record.expectations.at(index).detail + "\nevaluated on 0 of 0 ticks"));
  }
}

}  // namespace
}  // namespace hil::report
