// The syntax of DBC files: white space, comments, escapes, character sets, unfinished statements.

#include "io/can/dbc_text.hpp"

#include <gtest/gtest.h>

#include "io/can/dbc.hpp"

namespace hil::io::can {
namespace {

constexpr const char* layout_sample = R"(VERSION ""
NS_ :
	NS_DESC_
	CM_
	BA_DEF_
	BA_
	VAL_
	SG_MUL_VAL_
BS_:
BU_: A B
BO_ 100 M: 8 A
 SG_ S : 0|8@1+ (1,0) [0|255] "x" B,A
 SG_ T : 8|8@1+ (1,0) [0|255] "" B
BO_ 101 N: 8 A
 SG_ U : 0|8@1+ (1,0) [0|255] "" B
CM_ SG_ 100 S "text; with a
second line";
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;
BA_ "GenMsgCycleTime" BO_ 100 20;
VAL_ 100 S 0 "off" 1 "on" ;
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

void expect_the_sample(const std::string& text) {
  const DbcResult result = parse_dbc(text);
  EXPECT_TRUE(result.ok() && result.warning_count == 0) << describe_problems(result, "f") << text;
  ASSERT_EQ(result.database.messages.size(), 2U) << text;
  EXPECT_EQ(result.database.nodes, (std::vector<std::string>{"A", "B"})) << text;
  const DbcMessage& message = result.database.messages[0];
  ASSERT_EQ(message.signals.size(), 2U) << text;
  EXPECT_EQ(message.cycle_time_ms, 20) << text;
  EXPECT_EQ(message.signals[0].unit, "x") << text;
  EXPECT_EQ(message.signals[0].value_names.at(1), "on") << text;
  EXPECT_EQ(message.signals[1].name, "T") << text;
  EXPECT_EQ(result.database.messages[1].signals.size(), 1U) << text;
}

TEST(DbcLayout, WhiteSpaceHasNoMeaning) {
  const std::string content = layout_sample;
  expect_the_sample(content);
  expect_the_sample(replaced(content, "\n", "\r"));
  expect_the_sample(replaced(content, "\n", "\r\n"));
  expect_the_sample(replaced(content, "\n", "\n\n"));
  expect_the_sample(replaced(content, "\n", "\n  \t"));
  expect_the_sample(replaced(content, "\n\t", "\n"));
  expect_the_sample(replaced(replaced(content, "\n", " "), "\t", " "));
  expect_the_sample(replaced(content, "B,A", "B,\n A"));
  expect_the_sample(replaced(content, "B,A", "B\n,A"));
  expect_the_sample(replaced(content, "B,A", ""));
  expect_the_sample(replaced(content, "SG_ S :", "SG_\nS\n:"));
  expect_the_sample(replaced(content, "BA_DEF_ BO_", "BA_DEF_\nBO_"));
  expect_the_sample(replaced(content, "CM_ SG_", "CM_\nSG_"));
  expect_the_sample(replaced(content, "BA_ \"GenMsgCycleTime\" BO_", "BA_\n\"GenMsgCycleTime\"\nBO_"));
  expect_the_sample(replaced(content, "BS_:", "BS_: 500000 : 1,2"));
}

TEST(DbcLayout, CommentsBehindTwoSlashesAreWhiteSpace) {
  const std::string content = layout_sample;
  expect_the_sample("// \"a note\n" + content);
  expect_the_sample(replaced(content, "8 A\n", "8 A // sent by A; \"\n"));
  expect_the_sample(replaced(content, " SG_ T", " // SG_ Off : 8|8@1+ (1,0) [0|255] \"\" B\n SG_ T"));
  EXPECT_EQ(parse_dbc(replaced(content, "\"x\"", "\"http://x\"")).database.messages.at(0).signals.at(0).unit,
            "http://x");
}

TEST(DbcLayout, LinesAndColumnsCountEveryKindOfLineEnd) {
  for (const char* end : {"\n", "\r", "\r\n"}) {
    const DbcResult result = parse_dbc(replaced("BO_ 1 A: 8 E\n\n  hello\n", "\n", end));
    ASSERT_EQ(result.error_count, 1U);
    EXPECT_EQ(result.problems[0].line, 3U);
    EXPECT_EQ(result.problems[0].column, 3U);
  }
}

TEST(DbcLayout, UnterminatedStatementDoesNotHideTheNext) {
  for (const char* statement : {"CM_ \"made by a generator\"",
                                "CM_ BO_ 100 \"text\"",
                                "CM_ SG_ 100 S \"text\"",
                                "CM_",
                                "CM_ BO_ 100",
                                "CM_ \"never closed",
                                "VAL_ 100 S 1 \"on\" 0 \"off\"",
                                "VAL_ 100 S 1",
                                "VAL_",
                                "BA_ \"X\" BO_ 100 5",
                                "BA_ \"X\" \"text\"",
                                "BA_ \"X\"",
                                "BA_",
                                "BA_DEF_ BO_ \"X\" INT 0 1",
                                "BA_DEF_ \"X\" ENUM \"a\",\"b\"",
                                "BA_DEF_ BO_",
                                "BA_DEF_",
                                "BA_DEF_DEF_ \"X\" 1",
                                "BA_DEF_DEF_ \"X\"",
                                "VAL_TABLE_ T 0 \"a\"",
                                "SIG_VALTYPE_ 100 S : 0",
                                "SIG_GROUP_ 100 G 1 : S",
                                "EV_ E: 0 [0|0] \"\" 0 1 A"}) {
    // In the middle of the file and at its end.
    const std::string head = "BO_ 100 M: 8 A\n SG_ S : 0|8@1+ (1,0) [0|255] \"\" B\n";
    const std::string tail =
        "\nBO_ 101 N: 8 A\n SG_ T : 0|8@1+ (1,0) [0|255] \"\" B\nCM_ SG_ 101 T \"ends here\";\n"
        "BO_ 102 O: 8 A\n SG_ U : 0|8@1+ (1,0) [0|255] \"\" B\nVAL_ 100 S 2 \"two\" ;\n";
    const DbcResult result = parse_dbc(head + statement + tail);
    ASSERT_GE(result.error_count, 1U) << statement;
    EXPECT_TRUE(result.is_usable()) << statement;
    EXPECT_EQ(result.problems[0].line, 3U) << statement << "\n" << describe_problems(result, "f");
    EXPECT_EQ(result.problems[0].column, 1U) << statement << "\n" << describe_problems(result, "f");
    EXPECT_EQ(result.error_count, 1U) << statement << "\n" << describe_problems(result, "f");
    ASSERT_EQ(result.database.messages.size(), 3U) << statement;
    for (const DbcMessage& message : result.database.messages) {
      EXPECT_EQ(message.signals.size(), 1U) << statement;
      EXPECT_TRUE(message.unusable.empty()) << statement;
    }
    EXPECT_EQ(result.database.messages[0].signals[0].value_names.at(2), "two") << statement;
    EXPECT_EQ(parse_dbc(head + statement).error_count, 1U) << statement;
  }
}

TEST(DbcLayout, ValueNamesOfAnUnfinishedStatementAreKept) {
  const DbcResult result = parse_dbc(
      "BO_ 100 M: 8 A\n SG_ S : 0|8@1+ (1,0) [0|255] \"\" B\n SG_ T : 8|8@1+ (1,0) [0|255] \"\" B\n"
      "VAL_ 100 S 1 \"on\" 0 \"off\"\nVAL_ 100 T 2 \"two\" ;\n");
  ASSERT_EQ(result.error_count, 1U);
  EXPECT_EQ(result.problems[0].line, 4U);
  EXPECT_EQ(result.database.messages.at(0).signals.at(0).value_names.at(1), "on");
  EXPECT_EQ(result.database.messages.at(0).signals.at(1).value_names.at(2), "two");
}

TEST(DbcLayout, StatementsInsideOfStringsAreText) {
  const DbcResult result = parse_dbc(
      "BO_ 100 M: 8 A\n SG_ S : 0|8@1+ (1,0) [0|255] \"\" B\n"
      "CM_ SG_ 100 S \"says \\\"go\\\"; then\nBO_ 300 Fake: 8 A\n SG_ F : 0|8@1+ (1,0) [0|255] \\\"\\\" "
      "B\nend;\";\n"
      "VAL_ 100 S 0 \"a \\\"b\\\"\" 1 \"x;y\" 2 \"two\nlines\" 3 \"c:\\\\d\" 255 \"last\" ;\n");
  EXPECT_TRUE(result.ok() && result.warning_count == 0) << describe_problems(result, "f");
  ASSERT_EQ(result.database.messages.size(), 1U);
  const auto& names = result.database.messages[0].signals[0].value_names;
  EXPECT_EQ(names.at(0), "a \"b\"");
  EXPECT_EQ(names.at(1), "x;y");
  EXPECT_EQ(names.at(2), "two\nlines");
  EXPECT_EQ(names.at(3), "c:\\d");
  EXPECT_EQ(names.at(255), "last");
}

TEST(DbcLayout, EnvironmentAndTypeStatementsAreIgnored) {
  const DbcResult result = parse_dbc(
      "BO_ 100 M: 8 A\n SG_ X : 0|8@1+ (1,0) [0|0] \"\" B\n"
      "BA_DEF_SGTYPE_ \"q\" INT 0 1;\nBA_SGTYPE_ \"q\" SGTYPE_ st 1;\nSGTYPE_VAL_ st 1 \"a\" ;\n"
      "SGTYPE_ st : 8@1+ (1,0) [0|0] \"\" 0, t;\nBO_TX_BU_ 100 : A,B;\nVAL_ Env 0 \"x\" ;\n"
      "BA_DEF_REL_ BU_SG_REL_ \"r\" INT 0 1;\nBA_REL_ \"r\" BU_SG_REL_ A SG_ 100 X 1;\n"
      "BA_DEF_DEF_REL_ \"r\" 0;\nEV_ e: 0 [0|1] \"\" 0 1 DUMMY_NODE_VECTOR0 A;\nENVVAR_DATA_ e: 5;\n");
  EXPECT_TRUE(result.ok() && result.warning_count == 0) << describe_problems(result, "f");
  EXPECT_EQ(result.database.messages.size(), 1U);
}

TEST(DbcText, BytesThatAreNotUtf8AreCp1252) {
  EXPECT_EQ(dbc_text("\xB0"
                     "C"),
            "\u00B0C");
  EXPECT_EQ(dbc_text("\x80/h"), "\u20AC/h");
  EXPECT_EQ(dbc_text("driver\x92s side \x96 outside"), "driver\u2019s side \u2013 outside");
  EXPECT_EQ(dbc_text("l/100\xA0km"), "l/100\u00A0km");
  EXPECT_EQ(dbc_text("\x9F\x81"), "\u0178\u0081");
  EXPECT_EQ(dbc_text("\u00B0C \u20AC"), "\u00B0C \u20AC") << "it is UTF-8 already";
  EXPECT_EQ(dbc_text("\xE0\x80\x80"), "\u00E0\u20AC\u20AC") << "an overlong form is no UTF-8";
  EXPECT_EQ(dbc_text("\xED\xA0\x80"), "\u00ED\u00A0\u20AC") << "nor is half of a surrogate pair";
}

TEST(DbcText, EscapesAreUndone) {
  EXPECT_EQ(dbc_text("state \\\"on\\\""), "state \"on\"");
  EXPECT_EQ(dbc_text("a\\\\b"), "a\\b");
  EXPECT_EQ(dbc_text("C:\\temp"), "C:\\temp");
  EXPECT_EQ(dbc_text("\\"), "\\");
  EXPECT_EQ(dbc_text("\\\"\xB0"), "\"\u00B0");
}

}  // namespace
}  // namespace hil::io::can
