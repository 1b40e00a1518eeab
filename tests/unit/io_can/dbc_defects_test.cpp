// Messages that no frame can carry keep a reason, and the rest of the file loads.

#include <gtest/gtest.h>

#include "io/can/dbc.hpp"
#include "io/can/message_coder.hpp"

namespace hil::io::can {
namespace {

struct Defect {
  const char* text;    ///< statements of message 'M' and of the defect that makes it unusable
  const char* reason;  ///< part of it
  std::size_t line;
  std::size_t column;
};

TEST(DbcDefects, UnusableMessagesKeepTheirReasonAndTheRestLoads) {
  const std::string good = "BO_ 500 Good: 8 E\n SG_ G : 0|8@1+ (1,0) [0|0] \"\" X\n";
  const Defect defects[] = {
      {"BO_ 4096 M: 8 E\n",
       "identifier 4096 needs more than 11 bits, and bit 31, which marks a 29-bit identifier, is not set", 1,
       10},
      {"BO_ 419361280 M: 8 E\n", "identifier 419361280 needs more than 11 bits", 1, 15},
      {"BO_ 2684354560 M: 8 E\n", "needs more than 29 bits", 1, 16},
      {"BO_ 99999999999 M: 8 E\n", "needs more than 32 bits", 1, 17},
      {"BO_ 1 M: 65 E\n", "it has 65 bytes, and a frame has at most 64", 1, 7},
      {"BO_ 1 M: 1785 E\n", "it has 1785 bytes", 1, 7},
      {"BO_ 1 M: 17 E\n SG_ S : 0|136@1+ (1,0) [0|0] \"\" X\n", "signal 'S' has 136 bits", 2, 6},
      {"BO_ 1 M: 8 E\n SG_ S : 0|0@1+ (1,0) [0|0] \"\" X\n", "signal 'S' has 0 bits", 2, 6},
      {"BO_ 1 M: 8 E\n SG_ S : 0|8@1+ (0,0) [0|0] \"\" X\n", "signal 'S' has the factor 0", 2, 6},
      {"BO_ 1 M: 4 E\n SG_ S : 30|4@1+ (1,0) [0|0] \"\" X\n", "signal 'S' reaches beyond its 4 bytes", 2, 6},
      {"BO_ 1 M: 4 E\n SG_ S : 24|10@0+ (1,0) [0|0] \"\" X\n", "signal 'S' reaches beyond its 4 bytes", 2, 6},
      {"BO_ 1 M: 8 E\n SG_ S : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ S : 8|8@1+ (1,0) [0|0] \"\" X\n",
       "two of its signals are named 'S'", 3, 6},
      {"BO_ 1 M: 8 E\n SG_ S : 0|16@1- (1,0) [0|0] \"\" X\nSIG_VALTYPE_ 1 S : 1;\n",
       "signal 'S' has 16 bits, and a float has 32", 3, 16},
      {"BO_ 1 M: 8 E\n SG_ S m1 : 0|8@1+ (1,0) [0|0] \"\" X\n", "the message has no multiplexer", 2, 6},
      {"BO_ 1 M: 8 E\n SG_ S m : 0|8@1+ (1,0) [0|0] \"\" X\n", "its mark 'm' has no number", 2, 6},
      {"BO_ 1 M: 8 E\n SG_ O M : 0|4@1+ (1,0) [0|0] \"\" X\n SG_ I m1M : 4|4@1+ (1,0) [0|0] \"\" X\n"
       " SG_ D m1 : 8|4@1+ (1,0) [0|0] \"\" X\n",
       "several multiplexers and no SG_MUL_VAL_", 3, 6},
      {"BO_ 1 M: 8 E\n SG_ O m1M : 0|4@1+ (1,0) [0|0] \"\" X\n SG_ I m1M : 4|4@1+ (1,0) [0|0] \"\" X\n"
       "SG_MUL_VAL_ 1 O I 1-1;\nSG_MUL_VAL_ 1 I O 1-1;\n",
       "selects itself", 2, 6},
      {"BO_ 1 M: 8 E\n SG_ O M : 0|4@1+ (1,0) [0|0] \"\" X\n SG_ I M : 4|4@1+ (1,0) [0|0] \"\" X\n"
       " SG_ D m1 : 8|4@1+ (1,0) [0|0] \"\" X\nSG_MUL_VAL_ 1 D O 1-1;\nSG_MUL_VAL_ 1 D I 1-1;\n",
       "selected by two multiplexers", 6, 17},
  };
  for (const Defect& defect : defects) {
    const DbcResult result = parse_dbc(defect.text + good);
    EXPECT_TRUE(result.ok() && result.is_usable()) << defect.text << describe_problems(result, "f");
    ASSERT_GE(result.warning_count, 1U) << defect.text;
    EXPECT_EQ(result.problems[0].line, defect.line) << defect.text;
    EXPECT_EQ(result.problems[0].column, defect.column) << defect.text;
    const DbcMessage* const message = result.database.find_message("M");
    ASSERT_NE(message, nullptr) << defect.text;
    ASSERT_FALSE(message->unusable.empty()) << defect.text;
    EXPECT_NE(message->unusable[0].find(defect.reason), std::string::npos)
        << message->unusable[0] << " is not: " << defect.reason;
    for (const Use use : {Use::send, Use::receive}) {
      const auto problems = coding_problems(*message, {}, use);
      ASSERT_FALSE(problems.empty());
      EXPECT_NE(problems[0].find(defect.reason), std::string::npos) << problems[0];
    }
    const DbcMessage* const other = result.database.find_message("Good");
    ASSERT_NE(other, nullptr) << defect.text;
    EXPECT_TRUE(coding_problems(*other, {}, Use::send).empty()) << defect.text;
  }
}

TEST(DbcDefects, MessagesThatShareAnIdentifierOrANameAreBothUnusable) {
  const DbcResult ids = parse_dbc("BO_ 1 A: 8 E\nBO_ 1 B: 8 E\nBO_ 2 C: 8 E\n");
  ASSERT_EQ(ids.database.messages.size(), 3U);
  EXPECT_EQ(ids.database.messages[0].unusable.at(0), "its identifier is also that of message 'B'");
  EXPECT_EQ(ids.database.messages[1].unusable.at(0), "its identifier is also that of message 'A'");
  EXPECT_TRUE(ids.database.messages[2].unusable.empty());
  const DbcResult names = parse_dbc("BO_ 1 A: 8 E\nBO_ 2 A: 8 E\n");
  EXPECT_EQ(names.database.messages.at(0).unusable.at(0), "its name is also that of another message 'A'");
  EXPECT_EQ(names.database.messages.at(1).unusable.size(), 1U);
}

TEST(DbcDefects, MalformedSignalMakesOnlyItsMessageUnusable) {
  const DbcResult result = parse_dbc(
      "BO_ 1 A: 8 E\n SG_ 5X : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ Y : 0|8@1+ (1,0) [0|0] \"\" X\n"
      "BO_ 2 B: 8 E\n SG_ Z : 0|8@1+ (1,0) [0|0] \"\" X\n");
  EXPECT_EQ(result.error_count, 1U);
  EXPECT_TRUE(result.is_usable());
  EXPECT_EQ(result.problems.at(0).line, 2U);
  EXPECT_EQ(result.database.messages.at(0).unusable.at(0),
            "the signal in line 2 of the DBC file is not understood");
  EXPECT_TRUE(result.database.messages.at(1).unusable.empty());
}

TEST(DbcDefects, SignalsAfterAMalformedLineMakeTheirMessageUnusable) {
  const std::string signal = " SG_ S : 0|8@1+ (1,0) [0|0] \"\" X\n";
  const DbcResult before = parse_dbc("BO_ 1 A: 8 E\nB0_ 2 B: 8 E\n" + signal);
  EXPECT_EQ(before.error_count, 1U);
  EXPECT_NE(before.database.messages.at(0).unusable.at(0).find("line 2"), std::string::npos);
  const DbcResult behind = parse_dbc("BO_ 1 A: 8 E\n" + signal + "hello\nBO_ 2 B: 8 E\n" + signal);
  EXPECT_EQ(behind.error_count, 1U);
  EXPECT_TRUE(behind.database.messages.at(0).unusable.empty());
  EXPECT_TRUE(behind.database.messages.at(1).unusable.empty());
}

TEST(DbcDefects, MalformedDecodingStatementMakesItsMessageUnusable) {
  for (const char* statement : {"SIG_VALTYPE_ 1 S : 7;\n", "SG_MUL_VAL_ 1 S T 1;\n"}) {
    const DbcResult result =
        parse_dbc(std::string("BO_ 1 A: 8 E\n SG_ S : 0|32@1+ (1,0) [0|0] \"\" X\n") + statement);
    EXPECT_EQ(result.error_count, 1U) << statement;
    EXPECT_EQ(result.database.messages.at(0).unusable.size(), 1U) << statement;
  }
}

TEST(DbcDefects, OverlappingSignalsAreNamedInPairs) {
  const Dbc dbc =
      parse_dbc(
          "BO_ 1 A: 8 E\n SG_ One : 0|12@1+ (1,0) [0|0] \"\" X\n SG_ Two : 11|4@1+ (1,0) [0|0] \"\" X\n"
          " SG_ Three : 0|16@1+ (1,0) [0|0] \"\" X\n SG_ Four : 32|8@1+ (1,0) [0|0] \"\" X\n")
          .database;
  const auto problems = coding_problems(dbc.messages.at(0), {}, Use::send);
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_EQ(problems[0],
            "message 'A' can not be sent: these of its signals overlap: 'One' and 'Two', 'One' and 'Three', "
            "'Two' and 'Three'");
  EXPECT_TRUE(coding_problems(dbc.messages.at(0), {}, Use::receive).empty());
}

TEST(DbcDefects, ATextWithoutAnyMessageIsNotUsable) {
  for (const char* text :
       {"VERSION \"\"\nBU_: A\n", "\n  hello\n", "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 V\n"}) {
    const DbcResult result = parse_dbc(text);
    EXPECT_FALSE(result.is_usable()) << text;
    EXPECT_GE(result.problems.back().line, 1U) << text;
    EXPECT_NE(result.problems.back().text.find("gives no message"), std::string::npos) << text;
  }
  EXPECT_TRUE(parse_dbc("").ok());
  EXPECT_TRUE(parse_dbc(" \n\r\n\t").ok());
}

}  // namespace
}  // namespace hil::io::can
