// The attributes for frame formats, cycle times, start values and long names.

#include <gtest/gtest.h>

#include "io/can/dbc.hpp"
#include "io/can/message_coder.hpp"

namespace hil::io::can {
namespace {

const std::string messages =
    "BU_: A B\n"
    "BO_ 256 Short: 8 A\n SG_ V : 0|8@1+ (0.5,10) [0|100] \"\" B\n SG_ W : 8|8@1- (1,0) [0|0] \"\" B\n"
    "BO_ 257 Other: 8 A\n SG_ V : 0|8@1+ (1,0) [0|255] \"\" B\n"
    "BO_ 258 Long: 12 A\n SG_ V : 0|8@1+ (1,0) [0|255] \"\" B\n";
const std::string formats =
    "BA_DEF_ BO_ \"VFrameFormat\" ENUM \"StandardCAN\",\"ExtendedCAN\",\"reserved\",\"J1939PG\",\"reserved\","
    "\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\","
    "\"reserved\",\"StandardCAN_FD\",\"ExtendedCAN_FD\";\n"
    "BA_DEF_ BO_ \"CANFD_BRS\" ENUM \"0\",\"1\";\n";

Dbc read(const std::string& statements) {
  DbcResult result = parse_dbc(messages + statements);
  EXPECT_TRUE(result.ok()) << describe_problems(result, "f");
  return std::move(result.database);
}

TEST(DbcAttributes, FrameFormatSelectsClassicOrFd) {
  const Dbc dbc = read(formats +
                       "BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";\nBA_DEF_DEF_ \"CANFD_BRS\" \"1\";\n"
                       "BA_ \"VFrameFormat\" BO_ 256 14;\n");
  const DbcMessage& fd = *dbc.find_message("Short");
  EXPECT_TRUE(fd.is_fd && fd.format_is_stated && fd.bit_rate_switch);
  const DbcMessage& classic = *dbc.find_message("Other");
  EXPECT_TRUE(!classic.is_fd && classic.format_is_stated && !classic.bit_rate_switch);
  EXPECT_TRUE(dbc.find_message("Long")->is_fd) << "12 bytes fit in no classic frame";
}

TEST(DbcAttributes, BitRateSwitchComesFromTheMessageOrTheDefault) {
  const std::string fd = formats + "BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN_FD\";\n";
  EXPECT_FALSE(read(fd).find_message("Short")->bit_rate_switch) << "no default";
  EXPECT_FALSE(read(fd + "BA_DEF_DEF_ \"CANFD_BRS\" \"0\";\n").find_message("Short")->bit_rate_switch);
  const Dbc dbc = read(fd + "BA_DEF_DEF_ \"CANFD_BRS\" \"1\";\nBA_ \"CANFD_BRS\" BO_ 256 0;\n");
  EXPECT_FALSE(dbc.find_message("Short")->bit_rate_switch);
  EXPECT_TRUE(dbc.find_message("Other")->bit_rate_switch);
}

TEST(DbcAttributes, LengthSelectsFdWithoutAFrameFormat) {
  const Dbc dbc = read("");
  EXPECT_FALSE(dbc.find_message("Short")->is_fd || dbc.find_message("Short")->format_is_stated);
  EXPECT_TRUE(dbc.find_message("Long")->is_fd && dbc.find_message("Long")->format_is_stated);
}

TEST(DbcAttributes, UndefinedFormatsUseVectorsNumbers) {
  const Dbc dbc =
      read("BA_ \"VFrameFormat\" BO_ 256 15;\nBA_ \"VFrameFormat\" BO_ 257 \"StandardCAN_FD\";\n");
  EXPECT_TRUE(dbc.find_message("Short")->is_fd);
  EXPECT_TRUE(dbc.find_message("Other")->is_fd);
}

TEST(DbcAttributes, MessagesTooLongForTheirFormatAreUnusable) {
  const Dbc j1939 = read(formats + "BA_ \"VFrameFormat\" BO_ 258 3;\nBA_ \"VFrameFormat\" BO_ 256 3;\n");
  EXPECT_NE(j1939.find_message("Long")->unusable.at(0).find("a transport protocol, which hil"),
            std::string::npos);
  EXPECT_TRUE(j1939.find_message("Short")->unusable.empty() && !j1939.find_message("Short")->is_fd);
  const Dbc classic = read(formats + "BA_ \"VFrameFormat\" BO_ 258 0;\n");
  EXPECT_NE(classic.find_message("Long")->unusable.at(0).find("at most 8"), std::string::npos);
}

TEST(DbcAttributes, CycleTimesAndStartValuesHaveDefaults) {
  const Dbc dbc = read(
      "BA_DEF_DEF_ \"GenMsgCycleTime\" 100;\nBA_ \"GenMsgCycleTime\" BO_ 256 20;\n"
      "BA_DEF_DEF_ \"GenSigStartValue\" 3;\nBA_ \"GenSigStartValue\" SG_ 256 V 40;\n");
  EXPECT_EQ(dbc.find_message("Short")->cycle_time_ms, 20);
  EXPECT_EQ(dbc.find_message("Other")->cycle_time_ms, 100);
  EXPECT_EQ(dbc.find_message("Short")->find_signal("V")->start_raw, 40.0);
  EXPECT_EQ(dbc.find_message("Short")->find_signal("W")->start_raw, 3.0);
  EXPECT_FALSE(read("").find_message("Short")->find_signal("V")->start_raw);
}

TEST(DbcAttributes, EmptyDefaultsAndTextsForNumbersAreAccepted) {
  const Dbc dbc = read(
      "BA_DEF_ BO_ \"GenMsgCycleTime\" STRING ;\nBA_DEF_DEF_ \"GenMsgCycleTime\" \"\";\n"
      "BA_DEF_DEF_ \"GenSigStartValue\" \"\";\nBA_ \"GenMsgCycleTime\" BO_ 257 \"50\";\n");
  EXPECT_EQ(dbc.find_message("Short")->cycle_time_ms, 0);
  EXPECT_EQ(dbc.find_message("Other")->cycle_time_ms, 50);
  EXPECT_FALSE(dbc.find_message("Short")->find_signal("V")->start_raw);
}

TEST(DbcAttributes, LongNamesReplaceShortNamesAndBothAreFound) {
  const Dbc dbc = read(
      "BA_DEF_ SG_ \"SystemSignalLongSymbol\" STRING ;\nBA_DEF_DEF_ \"SystemSignalLongSymbol\" \"\";\n"
      "BA_ \"SystemSignalLongSymbol\" SG_ 256 V \"BatteryCellOverVoltageWarningIndexFront\";\n"
      "BA_ \"SystemMessageLongSymbol\" BO_ 256 \"BatteryManagementSystemCellStatus\";\n"
      "BA_ \"SystemNodeLongSymbol\" BU_ A \"BatteryManagementSystem\";\n");
  const DbcMessage* const message = dbc.find_message("BatteryManagementSystemCellStatus");
  ASSERT_NE(message, nullptr);
  EXPECT_EQ(message, dbc.find_message("Short"));
  EXPECT_EQ(message->name, "BatteryManagementSystemCellStatus");
  EXPECT_EQ(message->short_name, "Short");
  EXPECT_EQ(message->sender, "BatteryManagementSystem");
  EXPECT_EQ(dbc.nodes.at(0), "BatteryManagementSystem");
  const DbcSignal* const signal = message->find_signal("V");
  ASSERT_NE(signal, nullptr);
  EXPECT_EQ(signal, message->find_signal("BatteryCellOverVoltageWarningIndexFront"));
  EXPECT_EQ(signal->name, "BatteryCellOverVoltageWarningIndexFront");
}

TEST(DbcAttributes, InvalidLongNamesAreIgnored) {
  const DbcResult result = parse_dbc(messages +
                                     "BA_ \"SystemMessageLongSymbol\" BO_ 256 \"Other\";\n"
                                     "BA_ \"SystemSignalLongSymbol\" SG_ 256 V \"a name\";\n");
  EXPECT_EQ(result.warning_count, 2U) << describe_problems(result, "f");
  EXPECT_EQ(result.database.messages[0].name, "Short");
  EXPECT_EQ(result.database.messages[0].signals[0].name, "V");
}

TEST(DbcAttributes, MarkWithoutNumberUsesExtendedMultiplexing) {
  const DbcResult result = parse_dbc(
      "BO_ 100 M: 8 A\n SG_ S m : 0|8@1+ (1,0) [0|0] \"\" B\n SG_ a m0 : 8|8@1+ (1,0) [0|0] \"\" B\n"
      " SG_ b m : 8|8@1+ (1,0) [0|0] \"\" B\nSG_MUL_VAL_ 100 a S 0-0;\nSG_MUL_VAL_ 100 b S 1-2;\n"
      "SG_MUL_VAL_ 100 b S 7-7;\n");
  EXPECT_TRUE(result.ok() && result.warning_count == 0) << describe_problems(result, "f");
  const DbcMessage& message = result.database.messages.at(0);
  EXPECT_TRUE(message.unusable.empty());
  EXPECT_EQ(message.signals[0].multiplexer, -1);
  EXPECT_EQ(message.signals[2].multiplexer, 0);
  ASSERT_EQ(message.signals[2].multiplex_ranges.size(), 2U);
  EXPECT_EQ(message.signals[2].multiplex_ranges[1].first, 7U);
}

}  // namespace
}  // namespace hil::io::can
