#include "io/can/dbc.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <random>

#include "io/can/signal_overlap.hpp"
#include "tests/paths.h"
#include "tests/support/rounds.hpp"
#include "tests/support/text_mutator.hpp"

namespace hil::io::can {
namespace {

constexpr const char* sample = R"(VERSION "1.0"

NS_ :
	NS_DESC_
	CM_
	SG_MUL_VAL_

BS_:

BU_: Gateway Engine Dash
VAL_TABLE_ OnOff 1 "on" 0 "off" ;

BO_ 100 Motor: 8 Engine
 SG_ Speed : 0|16@1+ (0.25,0) [0|16000] "rpm"  Dash,Gateway
 SG_ Torque : 23|12@0- (0.5,-100) [-1124|923.5] "Nm" Dash
 SG_ Mode : 40|2@1+ (1,0) [0|3] "" Dash

BO_ 2147484160 Long: 8 Engine
 SG_ Ratio : 0|32@1- (1,0) [0|0] "" Dash
 SG_ Exact : 32|32@1- (1,0) [0|0] "" Dash

BO_ 200 Muxed: 8 Gateway
 SG_ Page M : 0|8@1+ (1,0) [0|255] "" Dash
 SG_ First m0 : 8|16@1+ (1,0) [0|0] "" Dash
 SG_ Second m1 : 8|16@1+ (1,0) [0|0] "" Dash

BO_ 201 Nested: 8 Gateway
 SG_ Outer M : 0|4@1+ (1,0) [0|15] "" Dash
 SG_ Inner m2M : 4|4@1+ (1,0) [0|15] "" Dash
 SG_ Deep m5 : 8|8@1+ (1,0) [0|255] "" Dash
 SG_ Other m3 : 4|12@1+ (1,0) [0|255] "" Dash

BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX
 SG_ Loose : 0|8@1+ (1,0) [0|0] "" Vector__XXX

CM_ SG_ 100 Speed "A comment; with a semicolon,
on two lines, and a \"quote\"";
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_ "GenMsgCycleTime" BO_ 100 20;
BA_ "Other" "text; here";
VAL_ 100 Mode 0 "park" 1 "drive" 3 "invalid" ;
SIG_VALTYPE_ 2147484160 Ratio : 1;
SG_MUL_VAL_ 201 Inner Outer 2-2;
SG_MUL_VAL_ 201 Deep Inner 5-5, 7-9;
SG_MUL_VAL_ 201 Other Outer 3-3;
)";

TEST(Dbc, ParsesMessagesAndSignals) {
  const DbcResult result = parse_dbc(sample);
  ASSERT_TRUE(result.ok()) << describe_problems(result, "sample.dbc");
  EXPECT_EQ(result.warning_count, 0U) << describe_problems(result, "sample.dbc");
  const Dbc& dbc = result.database;
  EXPECT_EQ(dbc.nodes, (std::vector<std::string>{"Gateway", "Engine", "Dash"}));
  EXPECT_EQ(dbc.value_tables.at("OnOff").at(1), "on");
  ASSERT_EQ(dbc.messages.size(), 4U);

  const DbcMessage* motor = dbc.find_message("Motor");
  ASSERT_NE(motor, nullptr);
  EXPECT_EQ(motor->id, 100U);
  EXPECT_FALSE(motor->is_extended);
  EXPECT_EQ(motor->length_bytes, 8U);
  EXPECT_EQ(motor->sender, "Engine");
  EXPECT_EQ(motor->cycle_time_ms, 20);
  const DbcSignal* torque = motor->find_signal("Torque");
  ASSERT_NE(torque, nullptr);
  EXPECT_EQ(torque->start_bit, 23U);
  EXPECT_EQ(torque->length_bits, 12U);
  EXPECT_EQ(torque->order, ByteOrder::motorola);
  EXPECT_EQ(torque->type, ValueType::signed_integer);
  EXPECT_EQ(torque->factor, 0.5);
  EXPECT_EQ(torque->offset, -100.0);
  EXPECT_EQ(torque->minimum, -1124.0);
  EXPECT_EQ(torque->maximum, 923.5);
  EXPECT_EQ(torque->unit, "Nm");
  EXPECT_EQ(motor->find_signal("Mode")->value_names.at(3), "invalid");
  EXPECT_EQ(motor->find_signal("nothing"), nullptr);

  const DbcMessage* extended = dbc.find_message("Long");
  ASSERT_NE(extended, nullptr);
  EXPECT_TRUE(extended->is_extended);
  EXPECT_EQ(extended->id, 512U);
  EXPECT_EQ(extended->find_signal("Ratio")->type, ValueType::float32);
  EXPECT_EQ(extended->find_signal("Exact")->type, ValueType::signed_integer);
}

TEST(Dbc, LinksMultiplexedSignals) {
  const Dbc dbc = parse_dbc(sample).database;
  const DbcMessage& muxed = *dbc.find_message("Muxed");
  EXPECT_TRUE(muxed.signals[0].is_multiplexer);
  EXPECT_EQ(muxed.signals[2].multiplexer, 0);
  EXPECT_EQ(muxed.signals[2].multiplex_ranges.at(0).first, 1U);
  EXPECT_TRUE(overlapping_pairs(muxed, 10).empty()) << "pages share bits";
  const DbcMessage& nested = *dbc.find_message("Nested");
  EXPECT_EQ(nested.find_signal("Deep")->multiplexer, 1);
  ASSERT_EQ(nested.find_signal("Deep")->multiplex_ranges.size(), 2U);
  EXPECT_EQ(nested.find_signal("Deep")->multiplex_ranges[1].last, 9U);
  EXPECT_TRUE(overlapping_pairs(nested, 10).empty()) << "selected by another value of the outer switch";
}

struct Mistake {
  const char* text;
  std::size_t line;
  std::size_t column;
  const char* problem;  ///< part of its text
};

TEST(Dbc, ReportsThePlacesOfMistakes) {
  const Mistake mistakes[] = {
      {"BO_ x Motor: 8 E\n", 1, 5, "identifier"},
      {"BO_ 1 Motor 8 E\n", 1, 13, "':'"},
      {"BO_ 1 A: 8 E\n SG_ S : 0|8@2+ (1,0) [0|0] \"\" X\n", 2, 14, "byte order"},
      {"BO_ 1 A: 8 E\n SG_ S : 0|8@1* (1,0) [0|0] \"\" X\n", 2, 15, "unsigned"},
      {"BO_ 1 A: 8 E\n SG_ S : 0|8@1+ (1,0) [0|0] \"m X\n", 2, 29, "unit"},
      {"BO_ 1 A: 8 E\n SG_ S q1 : 0|8@1+ (1,0) [0|0] \"\" X\n", 2, 8, "'M'"},
      {" SG_ S : 0|8@1+ (1,0) [0|0] \"\" X\n", 1, 2, "outside of a message"},
      {"VERSION \"\"\nHELLO world\n", 2, 1, "keyword"},
      {"CM_ \"never closed\n", 1, 1, "no ';'"},
      {"VAL_ 1 S 0 zero ;\n", 1, 12, "double quotes"},
  };
  for (const Mistake& mistake : mistakes) {
    const DbcResult result = parse_dbc(mistake.text);
    ASSERT_FALSE(result.ok()) << mistake.text;
    const DbcProblem& problem = result.problems.front();
    EXPECT_EQ(problem.line, mistake.line) << mistake.text << problem.text;
    EXPECT_EQ(problem.column, mistake.column) << mistake.text << problem.text;
    EXPECT_NE(problem.text.find(mistake.problem), std::string::npos) << problem.text;
  }
}

TEST(Dbc, ReportsEveryMistake) {
  const DbcResult result = parse_dbc(
      "BO_ 1 A: 8 E\n SG_ Bad : x|9@1+ (1,0) [0|0] \"\" X\n SG_ Good : 0|8@1+ (1,0) [0|0] \"\" X\n"
      "BO_ bad\nBO_ 2 B: 8 E\n SG_ Also : 0|8@1+ (1,0) [0|0] \"\" X\n");
  EXPECT_EQ(result.error_count, 2U);
  ASSERT_EQ(result.database.messages.size(), 2U);
  EXPECT_NE(result.database.messages[0].find_signal("Good"), nullptr);
  EXPECT_NE(result.database.messages[1].find_signal("Also"), nullptr);
}

TEST(Dbc, WarnsOfOverlappingSignals) {
  const DbcResult result = parse_dbc(
      "BO_ 1 A: 4 E\n SG_ One : 0|12@1+ (1,0) [0|0] \"\" X\n SG_ Two : 11|4@1+ (1,0) [0|0] \"\" X\n");
  EXPECT_TRUE(result.ok());
  EXPECT_EQ(result.warning_count, 1U) << describe_problems(result, "a.dbc");
  EXPECT_TRUE(result.database.messages.at(0).unusable.empty()) << "it can be received";
  EXPECT_NE(describe_problems(result, "a.dbc").find("a.dbc:3:6: warning: signal 'Two' overlaps signal 'One'"),
            std::string::npos);
}

TEST(Dbc, NodesMayBeOnSeparateLines) {
  const DbcResult result = parse_dbc("BU_:\n One\n Two\n\nBO_ 1 A: 8 One\n");
  EXPECT_TRUE(result.ok()) << describe_problems(result, "f");
  EXPECT_EQ(result.database.nodes, (std::vector<std::string>{"One", "Two"}));
  EXPECT_EQ(result.database.messages.size(), 1U);
}

TEST(Dbc, ReportsAMissingFile) {
  const DbcResult result = load_dbc("/nowhere/at/all.dbc");
  EXPECT_EQ(result.error_count, 1U);
  EXPECT_NE(result.problems.at(0).text.find("No such file"), std::string::npos);
  EXPECT_FALSE(load_dbc("/").ok());
}

// HIL_DBC_FOLDER may name a folder of databases from real cars; without it, the test reads those of configs/.
TEST(Dbc, EveryDatabaseOfAFolderLoads) {
  const char* const chosen = std::getenv("HIL_DBC_FOLDER");
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(
           chosen != nullptr ? chosen : HIL_SOURCE_DIR "/configs")) {
    if (entry.path().extension() != ".dbc") continue;
    ++files;
    const DbcResult result = load_dbc(entry.path());
    EXPECT_TRUE(result.ok()) << describe_problems(result, entry.path().string());
    EXPECT_TRUE(chosen != nullptr || result.warning_count == 0);
    EXPECT_FALSE(result.database.messages.empty()) << entry.path();
  }
  EXPECT_GT(files, 0U);
}

TEST(DbcFuzz, MutatedAndTruncatedTextsGiveValidDatabases) {
  tests::TextMutator mutator(99);
  const std::string original = sample;
  for (std::size_t length = 0; length <= original.size(); ++length)
    parse_dbc(original.substr(0, length));
  std::size_t refused = 0;
  for (int round = 0; round < 3000; ++round) {
    const DbcResult result = parse_dbc(mutator.mutate(original));
    refused += result.ok() ? 0 : 1;
    for (const DbcProblem& problem : result.problems)
      ASSERT_GE(problem.line, 1U);
    for (const DbcMessage& message : result.database.messages) {
      for (const DbcSignal& signal : message.signals) {
        ASSERT_GE(signal.length_bits, 1U);
        ASSERT_LE(signal.length_bits, 64U);
        ASSERT_LT(signal.multiplexer, static_cast<int>(message.signals.size()));
      }
    }
  }
  EXPECT_GT(refused, 1000U);
}

/// Real time is the subject: a reader that is quadratic in the length of the text takes far longer.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr double limit_s = 20.0;
#else
constexpr double limit_s = 0.7;
#endif

/// The CPU time of this thread. Time that grows with the square of the length is far beyond the limit.
double parse_seconds(const std::string& text, DbcResult& result) {
  const auto now_s = [] {
    timespec now{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  };
  const double begin_s = now_s();
  result = parse_dbc(text);
  return now_s() - begin_s;
}

TEST(DbcFuzz, RefusesTenMegabytesOfNoiseQuickly) {
  const std::size_t size = tests::rounds(10'000'000);
  std::mt19937_64 random(5);
  std::string noise(size, ' ');
  for (char& c : noise)
    c = static_cast<char>(random());
  std::string quotes;
  std::string unfinished;
  std::string lines;
  while (quotes.size() < size)
    quotes += "CM_ \\\"\n";
  while (unfinished.size() < size)
    unfinished += "CM_ x\n";
  while (lines.size() < size)
    lines += "\n";
  for (const std::string* text : {&noise, &quotes, &unfinished}) {
    DbcResult result;
    EXPECT_LT(parse_seconds(*text, result), limit_s);
    EXPECT_FALSE(result.ok());
    EXPECT_LE(result.problems.size(), DbcResult::kept_problems);
  }
  // Each line opens a string that ends at the end of the text only.
  std::string far_ends = "BO_ 1 A: 8 E\n";
  while (far_ends.size() < size)
    far_ends += "FILTER \\\"\n";
  DbcResult far_result;
  EXPECT_LT(parse_seconds(far_ends + "\"", far_result), limit_s);
  EXPECT_FALSE(far_result.ok());
  DbcResult result;
  EXPECT_LT(parse_seconds(lines, result), limit_s);
  EXPECT_TRUE(result.ok());
}

/// Multiplexers with thousands of values each, and chains of them, are the most expensive to compare.
TEST(DbcFuzz, RefusesHugeMultiplexingQuickly) {
  std::string wide = "BO_ 1 A: 8 E\n SG_ S M : 0|8@1+ (1,0) [0|0] \"\" X\n";
  std::string values;
  std::string chain = "BO_ 1 A: 8 E\n";
  for (int signal = 0; signal < 500; ++signal) {
    const std::string name = "s" + std::to_string(signal);
    wide += " SG_ " + name + " m0 : 8|8@1+ (1,0) [0|0] \"\" X\n";
    chain += " SG_ " + name + " : 8|8@1+ (1,0) [0|0] \"\" X\n";
    values += "SG_MUL_VAL_ 1 " + name + " S ";
    for (int range = 0; range < 2000; ++range)
      values += std::to_string(1'000'000 * range + 2 * signal) + "-" +
                std::to_string(1'000'000 * range + 2 * signal) + ",";
    values.back() = ';';
    values += "\n";
  }
  for (int signal = 0; signal < 499; ++signal)
    chain += "SG_MUL_VAL_ 1 s" + std::to_string(signal) + " s" + std::to_string(signal + 1) + " 1-1;\n";
  for (const std::string& text : {wide + values, chain}) {
    DbcResult result;
    EXPECT_LT(parse_seconds(text, result), 2.0 * limit_s);
    EXPECT_FALSE(result.database.messages.at(0).unusable.empty());
  }
}

TEST(DbcFuzz, ALargeDatabaseLoadsFast) {
  std::string text = "VERSION \"\"\n";
  for (int message = 0; message < 2000; ++message) {
    const std::string id = std::to_string(2147483648U + static_cast<unsigned>(message));
    text += "BO_ " + id + " Message" + std::to_string(message) + ": 64 Node\n";
    for (int signal = 0; signal < 40; ++signal) {
      text += " SG_ Signal" + std::to_string(signal) + " : " + std::to_string(12 * signal) +
              "|12@1+ (0.1,-40) [0|100] \"km/h\" A,B,C\n";
    }
    text += "CM_ BO_ " + id + " \"some words about this message; they are passed over\";\n";
  }
  DbcResult result;
  const double seconds = parse_seconds(text, result);
  EXPECT_TRUE(result.ok() && result.warning_count == 0) << describe_problems(result, "large");
  EXPECT_EQ(result.database.messages.size(), 2000U);
  EXPECT_LT(seconds, limit_s);
  RecordProperty("megabytes_per_second", static_cast<int>(static_cast<double>(text.size()) / 1e6 / seconds));
}

}  // namespace
}  // namespace hil::io::can
