#include "runtime/report/text_safety.hpp"

#include <gtest/gtest.h>

#include <random>

#include "hostile_text.hpp"
#include "strict_xml.hpp"

namespace hil::report {
namespace {

const std::string lost = "\xEF\xBF\xBD";

TEST(CleanText, KeepsUtf8AsItIs) {
  for (const char* text : {"", "plain", "µ ü", "漢字", "😀", "a\tb\nc\rd", "\xf4\x8f\xbf\xbd"})
    EXPECT_EQ(clean_text(text), text);
}

TEST(CleanText, ReplacesEachByteThatIsNotUtf8) {
  EXPECT_EQ(clean_text("a\xff"
                       "b"),
            "a" + lost + "b");
  EXPECT_EQ(clean_text("\xc3("), lost + "(");
  EXPECT_EQ(clean_text("\x80"), lost);
  EXPECT_EQ(clean_text("\xe2\x82"), lost + lost) << "cut short";
  EXPECT_EQ(clean_text("\xed\xa0\x80"), lost + lost + lost) << "surrogate";
  EXPECT_EQ(clean_text("\xc0\xaf"), lost + lost) << "overlong";
  EXPECT_EQ(clean_text("\xe0\x80\xaf"), lost + lost + lost) << "overlong";
  EXPECT_EQ(clean_text("\xf4\x90\x80\x80"), lost + lost + lost + lost) << "past U+10FFFF";
}

TEST(CleanText, ReplacesCharactersThatDocumentsForbid) {
  EXPECT_EQ(clean_text(std::string("a\0b", 3)), "a" + lost + "b");
  EXPECT_EQ(clean_text("\x1b"), lost);
  EXPECT_EQ(clean_text("\x7f"), lost);
  EXPECT_EQ(clean_text("\xc2\x85"), lost);
  EXPECT_EQ(clean_text("\xef\xbf\xbe"), lost);
}

TEST(ValidUtf8, ReplacesOnlyWhatIsNotUtf8) {
  EXPECT_EQ(valid_utf8("\x1b[0m\xc2\x85\xff"), "\x1b[0m\xc2\x85" + lost);
}

TEST(CleanText, IsIdempotentOnRandomBytes) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int round = 0; round < 2000; ++round) {
    std::string bytes;
    for (int index = 0; index < 24; ++index)
      bytes += static_cast<char>(byte(random));
    const std::string clean = clean_text(bytes);
    ASSERT_EQ(clean_text(clean), clean);
  }
}

TEST(EscapeMarkup, ComesBackFromAParserAsTheCleanText) {
  std::vector<std::string> texts = test::hostile_texts();
  std::mt19937 random(8);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int round = 0; round < 500; ++round) {
    std::string bytes;
    for (int index = 0; index < 40; ++index)
      bytes += static_cast<char>(byte(random));
    texts.push_back(bytes);
  }
  for (const std::string& text : texts) {
    const std::string escaped = escape_markup(text);
    std::string document = "<a b=\"";
    document.append(escaped).append("\">").append(escaped).append("</a>");
    const test::XmlElement parsed = test::parse_strictly(document);
    EXPECT_EQ(parsed.text, clean_text(text));
    EXPECT_EQ(parsed.attributes.at("b"), clean_text(text));
  }
}

TEST(OneLine, HasNoControlCharacterLeft) {
  for (const std::string& text : test::hostile_texts()) {
    for (const char c : one_line(text))
      EXPECT_GE(static_cast<unsigned char>(c), 0x20U);
  }
  EXPECT_EQ(one_line("a\nb\tc"), "a b c");
}

TEST(ColumnsOf, CountsCharactersNotBytes) {
  EXPECT_EQ(columns_of(""), 0U);
  EXPECT_EQ(columns_of("µs"), 2U);
}

}  // namespace
}  // namespace hil::report
