// What the YAML reader refuses independently of the schema, with its places.

#include "config_fixture.hpp"

namespace hil::config {
namespace {

using test::has_mistake;
using test::is_only_mistake;

/// a: anything, b: anything.
Schema open_schema() {
  return Schema::record({Field::optional("a", Schema::any(), "One."),
                         Field::optional("b", Schema::any(), "Two."),
                         Field::optional("t", Schema::text(), "Text."),
                         Field::optional("l", Schema::list(Schema::text()), "Texts.")});
}

Diagnostics mistakes_of(std::string_view text) {
  Diagnostics diagnostics;
  const std::optional<Value> value = parse_text("f.yaml", text, open_schema(), diagnostics);
  EXPECT_EQ(value.has_value(), diagnostics.empty());
  for (const Mistake& mistake : diagnostics.mistakes())
    EXPECT_EQ(mistake.place.file, "f.yaml");
  return diagnostics;
}

std::string text_of(std::string_view yaml) {
  Diagnostics diagnostics;
  const std::optional<Value> value = parse_text("f.yaml", yaml, open_schema(), diagnostics);
  EXPECT_TRUE(value.has_value()) << diagnostics.to_text();
  return value ? (*value)["t"].text() : "";
}

TEST(Yaml, TextIsTakenLiterally) {
  EXPECT_EQ(text_of("t: no"), "no");
  EXPECT_EQ(text_of("t: on"), "on");
  EXPECT_EQ(text_of("t: 010"), "010");
  EXPECT_EQ(text_of("t: 1e400"), "1e400");
  EXPECT_EQ(text_of("t: 12:30:45"), "12:30:45");
  EXPECT_EQ(text_of("t: 'it''s'"), "it's");
  EXPECT_EQ(text_of("t: \"a\\u00e4\""), "a\xC3\xA4");
  EXPECT_EQ(text_of("t: >-\n  two\n  lines\n"), "two lines");
  EXPECT_EQ(text_of("\xEF\xBB\xBFt: after a byte order mark"), "after a byte order mark");
  EXPECT_EQ(text_of("t: windows\r\n"), "windows");
}

TEST(Yaml, EmptyTextIsAMistake) {
  for (const char* text : {"", "\n\n", "# only a remark\n", "---\n", "~", "null\n"}) {
    EXPECT_TRUE(is_only_mistake(mistakes_of(text), 1, 1, "the text is empty; a document has keys and values"))
        << text;
  }
}

TEST(Yaml, WrongTextsAreRefusedAtTheirPlaces) {
  const struct {
    std::string_view text;
    std::uint32_t line, column;
    const char* words;
  } refusals[] = {
      {"Dear all, this is a letter.", 1, 1, "expected keys and values"},
      {"- a\n- b\n", 1, 1, "expected keys and values, found a list"},
      {"a: 1\n---\nb: 2\n", 2, 1, "a second document"},
      {"a: 1\nt:\n\n\nb: 2\n", 2, 1, "'t': expected text, found nothing"},
      {"a:\n", 1, 1, "'a': has no value; write {} for none"},
      // Syntax.
      {"a: [1, 2\n", 2, 1, "this is not YAML"},
      {"a: 1\nb: 'open\n", 2, 4, "this quotation mark is never closed"},
      {"a: 1\nb: &x \"open\\\"\n", 2, 7, "never closed"},
      {"a: 'it''s", 1, 10, "this is not YAML"},
      {"a: 1\n b: 2\n", 2, 3, "this is not YAML"},
      {"a: *unknown\n", 1, 4, "this is not YAML"},
      // Bytes that are no UTF-8: overlong, surrogate, above U+10FFFF, cut short, control characters, UTF-16.
      {"a: 1\nb: x\xFFy\n", 2, 5, "0xFF is not valid UTF-8"},
      {"a: \xC0\xAF", 1, 4, "0xC0"},
      {"a: \xED\xA0\x80", 1, 4, "0xED"},
      {"a: \xF4\x90\x80\x80", 1, 4, "0xF4"},
      {"a: \xE2\x82", 1, 4, "0xE2"},
      {std::string_view("a: b\0c", 6), 1, 5, "0x00"},
      {"a: \x1B[31m", 1, 4, "0x1B"},
      {"\xFF\xFE a", 1, 1, "0xFF"},
      // Columns count characters.
      {"{a: \xC3\xA4\xE2\x82\xAC, zz: 1}", 1, 9, "unknown key 'zz'"},
      // Duplicate keys, and anchors that contain themselves.
      {"a: 1\nb: 2\na: 3\n", 3, 1, "'a' is given twice; first in line 1"},
      {"a:\n  x: {y: 1, y: 2}\n", 2, 13, "'y' is given twice"},
      {"a: &x [1, *x]\n", 1, 11, "inside its own anchor"},
      {"a: &x {k: {l: *x}}\n", 1, 15, "inside its own anchor"},
      // Merge keys, tags and complex keys.
      {"a: &x {k: 1}\nb:\n  <<: *x\n", 3, 3, "merge keys"},
      {"a: !!int 5\n", 1, 4, "tag"},
      {"a: !mine {k: 1}\n", 1, 4, "tag '!mine'"},
      {"a: {[1, 2]: 3}\n", 1, 5, "a key has to be a word"},
      {"a: 1\n? {x: 1}\n: 2\n", 2, 3, "a key has to be a word"},
      {"~: 1\n", 1, 1, "a key has to be a word"}};
  for (const auto& [text, line, column, words] : refusals)
    EXPECT_TRUE(is_only_mistake(mistakes_of(text), line, column, words)) << text;
}

TEST(Yaml, TabsInTheIndentationAreAllReported) {
  const Diagnostics diagnostics = mistakes_of("a:\n\tx: 1\nb:\n  \ty: 2\n\t# a remark may\n\t\n");
  EXPECT_EQ(diagnostics.count(), 2U);
  EXPECT_TRUE(has_mistake(diagnostics, 2, 1, "tab"));
  EXPECT_TRUE(has_mistake(diagnostics, 4, 3, "tab"));
  EXPECT_EQ(text_of("t: inside\tit is fine"), "inside\tit is fine");
}

TEST(Yaml, AnchorsAreCopied) {
  Diagnostics diagnostics;
  const auto value = parse_text("f.yaml", "l: [&x one, *x]\nt: *x\n", open_schema(), diagnostics);
  ASSERT_TRUE(value) << diagnostics.to_text();
  EXPECT_EQ((*value)["l"].items()[1].text(), "one");
  EXPECT_EQ((*value)["t"].text(), "one");
  EXPECT_EQ((*value)["t"].place(), (Place{"f.yaml", 1, 8}));  // where it is written
}

TEST(Yaml, MistakesOfSyntaxHideNoneOfTheSchema) {
  const Diagnostics diagnostics = mistakes_of("a: 1\na: 2\nl: 5\n");
  EXPECT_EQ(diagnostics.count(), 2U);
  EXPECT_TRUE(has_mistake(diagnostics, 2, 1, "twice"));
  EXPECT_TRUE(has_mistake(diagnostics, 3, 4, "'l': expected a list, found '5'"));
}

}  // namespace
}  // namespace hil::config
