#include "runtime/report/text_safety.hpp"

#include <gtest/gtest.h>

#include <random>

#include "hostile_text.hpp"
#include "strict_xml.hpp"

namespace hil::report {
namespace {

const std::string replacement = "\xEF\xBF\xBD";

TEST(CleanText, KeepsValidUtf8) {
  for (const char* text : {"", "plain", "µ ü", "漢字", "😀", "a\tb\nc\rd", "\xf4\x8f\xbf\xbd"})
    EXPECT_EQ(clean_text(text), text);
}

TEST(CleanText, ReplacesEachByteThatIsNotUtf8) {
  EXPECT_EQ(clean_text("a\xff"
                       "b"),
            "a" + replacement + "b");
  EXPECT_EQ(clean_text("\xc3("), replacement + "(");
  EXPECT_EQ(clean_text("\x80"), replacement);
  EXPECT_EQ(clean_text("\xe2\x82"), replacement + replacement) << "cut short";
  EXPECT_EQ(clean_text("\xed\xa0\x80"), replacement + replacement + replacement) << "surrogate";
  EXPECT_EQ(clean_text("\xc0\xaf"), replacement + replacement) << "overlong";
  EXPECT_EQ(clean_text("\xe0\x80\xaf"), replacement + replacement + replacement) << "overlong";
  EXPECT_EQ(clean_text("\xf4\x90\x80\x80"), replacement + replacement + replacement + replacement)
      << "past U+10FFFF";
}

TEST(CleanText, ReplacesCharactersThatDocumentsForbid) {
  EXPECT_EQ(clean_text(std::string("a\0b", 3)), "a" + replacement + "b");
  EXPECT_EQ(clean_text("\x1b"), replacement);
  EXPECT_EQ(clean_text("\x7f"), replacement);
  EXPECT_EQ(clean_text("\xc2\x85"), replacement);
  EXPECT_EQ(clean_text("\xef\xbf\xbe"), replacement);
}

TEST(ValidUtf8, ReplacesOnlyWhatIsNotUtf8) {
  EXPECT_EQ(valid_utf8("\x1b[0m\xc2\x85\xff"), "\x1b[0m\xc2\x85" + replacement);
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

TEST(EscapeMarkup, IsReadBackAsTheCleanText) {
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

TEST(OneLine, HasNoControlCharacters) {
  for (const std::string& text : test::hostile_texts()) {
    for (const char c : one_line(text))
      EXPECT_GE(static_cast<unsigned char>(c), 0x20U);
  }
  EXPECT_EQ(one_line("a\nb\tc"), "a b c");
}

TEST(ColumnsOf, CountsCharacters) {
  EXPECT_EQ(columns_of(""), 0U);
  EXPECT_EQ(columns_of("µs"), 2U);
}

}  // namespace
}  // namespace hil::report
