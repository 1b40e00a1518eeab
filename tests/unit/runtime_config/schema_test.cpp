#include <unistd.h>

#include "config_fixture.hpp"

namespace hil::config {
namespace {

using test::has_mistake;
using test::is_only_mistake;
using tests::TemporaryFolder;

Schema one(Schema schema) {
  return Schema::record({Field::needed("v", std::move(schema), "The value.")});
}

Diagnostics mistakes_of(const std::string& written, const Schema& schema) {
  Diagnostics diagnostics;
  const bool is_accepted = parse_text("f.yaml", "v: " + written, one(schema), diagnostics).has_value();
  EXPECT_EQ(is_accepted, diagnostics.empty());
  return diagnostics;
}

Value value_of(const std::string& written, const Schema& schema) {
  Diagnostics diagnostics;
  const std::optional<Value> value = parse_text("f.yaml", "v: " + written, one(schema), diagnostics);
  if (!value) throw std::runtime_error(diagnostics.to_text());
  return (*value)["v"];
}

TEST(SchemaScalars, HaveTheirValues) {
  EXPECT_TRUE(value_of("true", Schema::boolean()).boolean());
  EXPECT_FALSE(value_of("false", Schema::boolean()).boolean());
  EXPECT_EQ(value_of("98", Schema::integer(1, 98)).integer(), 98);
  EXPECT_EQ(value_of("0x10", Schema::integer(1, 98)).integer(), 16);
  EXPECT_EQ(value_of("1e-1", Schema::number(0.0, 1.0)).number(), 0.1);
  for (const char* speed : {"36 km/h", "\"36 km/h\""})
    EXPECT_DOUBLE_EQ(value_of(speed, Schema::quantity(Quantity::speed_mps, 0.0, 50.0)).number(), 10.0);
  EXPECT_EQ(value_of("1 ms", Schema::quantity(Quantity::duration_s, 0.0, 1.0)).duration_ns(), 1'000'000);
  EXPECT_EQ(value_of("virtual", Schema::one_of({"realtime", "virtual"})).text(), "virtual");
  EXPECT_EQ(value_of("_a1", Schema::name()).text(), "_a1");
  EXPECT_EQ(value_of("can.car.X.Y", Schema::signal()).text(), "can.car.X.Y");
}

TEST(SchemaScalars, AreRefusedWithTheReason) {
  constexpr double unlimited = std::numeric_limits<double>::infinity();
  const Schema percent = Schema::integer(1, 98);
  const Schema share = Schema::number(0.0, 1.0);
  const Schema speed = Schema::quantity(Quantity::speed_mps, 0.0, 50.0);
  const Schema clock = Schema::one_of({"realtime", "virtual"});
  const std::tuple<Schema, std::vector<const char*>, const char*> refusals[] = {
      {Schema::boolean(), {"yes", "no", "on", "off", "True", "FALSE", "y", "1", "0"}, "write true or false"},
      {Schema::boolean(), {"\"true\""}, "without quotes"},
      {Schema::boolean(), {"[true]"}, "expected true or false, found a list"},
      {percent, {"99"}, "'v': 99 is out of range; it can be from 1 to 98"},
      {percent, {"0"}, "out of range"},
      {percent, {"1.5"}, "'1.5' is not a whole number"},
      {percent, {"010"}, "leading zero"},
      {percent, {"99999999999999999999"}, "does not fit into 64 bits"},
      {percent, {"'5'"}, "without quotes"},
      {share, {"1.5"}, "1.5 is out of range; it can be from 0 to 1"},
      {share, {".nan"}, "'.nan' is not a finite number"},
      {share, {"-.inf"}, "finite"},
      {share, {"1e400"}, "too large"},
      {share, {"0.5 m"}, "This value has no unit"},
      {speed, {"200 km/h"}, "'200 km/h' is out of range; it can be from 0 km/h to 180 km/h"},
      {speed, {"-1 m/s"}, "from 0 m/s to 50 m/s"},
      {speed, {"50 kg"}, "written in m/s, km/h"},
      {speed, {"50"}, "no unit"},
      {Schema::quantity(Quantity::length_m, 0.0, unlimited), {"-1 m"}, "it can be at least 0 m"},
      {Schema::quantity(Quantity::data_bytes, 0x1p20, 0x1p40),
       {"7 B", "2 TiB"},
       "it can be from 1 MiB to 1 TiB"},
      {Schema::quantity(Quantity::data_bytes, 1500.0, 0x1p40 + 1.0),
       {"7 B", "2 TiB"},
       "it can be from 1500 B to 1099511627777 B"},
      {clock, {"virtul"}, "'virtul' is not one of: realtime, virtual; did you mean 'virtual'?"},
      {clock, {"wall"}, "'wall' is not one of: realtime, virtual"},
      {Schema::name(), {"1a", "a-b", "a.b", "'a b'", "\xC3\xA4"}, "is not a name"},
      {Schema::signal(), {"a..b", ".a", "a.", "a.1", "a b"}, "is not a signal's name"},
      {Schema::text(), {"''"}, "found an empty text"},
      {Schema::file(), {"/no/such/file"}, "'/no/such/file': there is no such file"},
      {Schema::file(), {"/tmp"}, "this is a directory"},
      {Schema::file(), {"/dev/null"}, "not a regular file"},
      {Schema::file(), {"[a]"}, "expected a file's path, found a list"}};
  for (const auto& [schema, texts, words] : refusals) {
    for (const char* text : texts)
      EXPECT_TRUE(is_only_mistake(mistakes_of(text, schema), 1, 4, words)) << text;
  }
}

TEST(SchemaFiles, AreRelativeToTheFileThatNamesThem) {
  const TemporaryFolder folder;
  folder.write("data.txt", "x");
  const std::string file = folder.write("f.yaml", "v: ./sub/../data.txt\n");
  Diagnostics diagnostics;
  const auto value = parse_file(file, one(Schema::file()), diagnostics);
  ASSERT_TRUE(value) << diagnostics.to_text();
  EXPECT_EQ((*value)["v"].text(), (folder.path() / "data.txt").string());
}

/// The process is no root in this scope, since root may read everything.
class WithoutRoot {
 public:
  WithoutRoot() : changed_(geteuid() == 0 && seteuid(65534) == 0) {}
  ~WithoutRoot() {
    if (changed_ && seteuid(0) != 0) std::abort();
  }
  WithoutRoot(const WithoutRoot&) = delete;
  WithoutRoot& operator=(const WithoutRoot&) = delete;

 private:
  bool changed_;
};

TEST(SchemaFiles, UnreadableFilesAreMistakes) {
  const TemporaryFolder folder;
  const std::string secret = folder.write("secret.txt", "x");
  std::filesystem::permissions(folder.path(), std::filesystem::perms::all);
  std::filesystem::permissions(secret, std::filesystem::perms::none);
  const WithoutRoot ordinary_user;
  EXPECT_TRUE(is_only_mistake(mistakes_of(secret, Schema::file()), 1, 4, "Permission denied"));
  Diagnostics diagnostics;
  EXPECT_FALSE(parse_file(secret, one(Schema::text()), diagnostics));
  EXPECT_TRUE(is_only_mistake(diagnostics, 0, 0, "can not be opened: Permission denied"));
}

TEST(SchemaLists, CheckTheirLengthAndEachEntry) {
  const Schema three = Schema::list(Schema::integer(0, 9), 3, 3);
  EXPECT_EQ(value_of("[1, 2, 3]", three).items()[2].integer(), 3);
  EXPECT_TRUE(is_only_mistake(mistakes_of("[1, 2]", three), 1, 4, "'v': a list of 2; expected 3"));
  EXPECT_TRUE(is_only_mistake(mistakes_of("[]", Schema::list(Schema::text(), 1)), 1, 4, "at least 1"));
  EXPECT_TRUE(is_only_mistake(mistakes_of("[a, b]", Schema::list(Schema::text(), 0, 1)), 1, 4, "at most 1"));
  const Diagnostics diagnostics = mistakes_of("[x, 2, 10]", three);
  EXPECT_EQ(diagnostics.count(), 2U);
  EXPECT_TRUE(has_mistake(diagnostics, 1, 5, "entry 0 of 'v': 'x' is not a whole number"));
  EXPECT_TRUE(has_mistake(diagnostics, 1, 11, "entry 2 of 'v': 10 is out of range"));
}

Schema car() {
  return Schema::record({
      Field::needed("name", Schema::name(), "Its name."),
      Field::with_default("speed", Schema::quantity(Quantity::speed_mps, 0.0, 50.0), "36 km/h", "Its speed."),
      Field::optional("about", Schema::text(), "A remark."),
  });
}

TEST(SchemaRecords, FillDefaultsAndKeepPlaces) {
  const Value value = value_of("\n  about: x\n  name: ego\n", car());
  EXPECT_EQ(value["name"].place(), (Place{"f.yaml", 3, 9}));
  EXPECT_DOUBLE_EQ(value["speed"].number(), 10.0);
  EXPECT_EQ(value["speed"].place(), value.place());
  ASSERT_EQ(value.entries().size(), 3U);
  EXPECT_EQ(value.entries()[0].first, "about");
  EXPECT_EQ(value.entries()[1].first, "name");
  EXPECT_EQ(value.entries()[2].first, "speed");
  EXPECT_EQ(value.key_place(1), (Place{"f.yaml", 3, 3}));
  EXPECT_FALSE(value_of("{name: ego}", car()).has("about"));
}

TEST(SchemaRecords, ReportAllMistakes) {
  const Diagnostics diagnostics = mistakes_of("\n  sped: 3 m/s\n  speed: 3 kg\n  colour: red\n", car());
  EXPECT_EQ(diagnostics.to_text(),
            "f.yaml:2:3: unknown key 'sped'; did you mean 'speed'?\n"
            "f.yaml:2:3: missing key 'name' (Its name.)\n"
            "f.yaml:3:10: 'speed': '3 kg' has the unit 'kg', but a speed is written in m/s, km/h\n"
            "f.yaml:4:3: unknown key 'colour'; known here: name, speed, about\n");
}

TEST(SchemaRecords, AcceptTheShortFormOfOneField) {
  const Schema message =
      Schema::record_or("name", {Field::needed("name", Schema::name(), "Which."),
                                 Field::with_default("count", Schema::integer(0, 9), "1", "How many.")});
  const Value value = value_of("BrakeCommand", message);
  EXPECT_EQ(value["name"].text(), "BrakeCommand");
  EXPECT_EQ(value["name"].place(), (Place{"f.yaml", 1, 4}));
  EXPECT_EQ(value["count"].integer(), 1);
  EXPECT_EQ(value_of("{name: B, count: 2}", message)["count"].integer(), 2);
  EXPECT_TRUE(is_only_mistake(mistakes_of("a-b", message), 1, 4, "'name': 'a-b' is not a name"));
  EXPECT_TRUE(
      is_only_mistake(mistakes_of("[B]", message), 1, 4, "expected keys and values, or 'name' alone"));
}

TEST(SchemaMaps, KeepNamesAndTheirOrder) {
  const Schema schema = Schema::map(Schema::integer(0, 9));
  const Value value = value_of("{b: 1, a: 2}", schema);
  EXPECT_EQ(value.entries()[0].first, "b");
  EXPECT_EQ(value["a"].integer(), 2);
  EXPECT_EQ(value.key_place(1), (Place{"f.yaml", 1, 11}));
  EXPECT_TRUE(is_only_mistake(mistakes_of("{a b: 1}", schema), 1, 5, "the key 'a b' is not a name"));
  EXPECT_TRUE(is_only_mistake(mistakes_of("{a: x}", schema), 1, 8, "'a': 'x' is not a whole number"));
}

TEST(SchemaChoices, FollowTheirKey) {
  const Schema schema = Schema::choice(
      "type", {{"scanner", Schema::record({Field::needed("columns", Schema::integer(1, 999), "Columns.")})},
               {"traffic", Schema::record({Field::optional("cars", Schema::integer(0, 9), "Cars.")})}});
  const Value value = value_of("{columns: 5, type: scanner}", schema);
  EXPECT_EQ(value.chosen(), "scanner");
  EXPECT_EQ(value["type"].text(), "scanner");
  EXPECT_EQ(value["columns"].integer(), 5);
  EXPECT_EQ(value.kind(), Kind::choice);
  EXPECT_TRUE(is_only_mistake(mistakes_of("{type: scaner}", schema), 1, 11, "did you mean 'scanner'?"));
  EXPECT_TRUE(is_only_mistake(mistakes_of("{columns: 5}", schema), 1, 4, "missing key 'type'"));
  EXPECT_TRUE(
      is_only_mistake(mistakes_of("{type: traffic, columns: 5}", schema), 1, 20, "unknown key 'columns'"));
}

TEST(SchemaExactlyOne, AcceptsExactlyOneKey) {
  const Schema schema =
      Schema::exactly_one({Field::optional("box", Schema::integer(0, 9), "A box."),
                           Field::optional("ball", Schema::integer(0, 9), "A ball.")},
                          {Field::with_default("colour", Schema::name(), "red", "Its colour.")});
  const Value value = value_of("{ball: 3}", schema);
  EXPECT_EQ(value.chosen(), "ball");
  EXPECT_EQ(value["colour"].text(), "red");
  EXPECT_FALSE(value.has("box"));
  EXPECT_TRUE(is_only_mistake(mistakes_of("{box: 1, ball: 2}", schema), 1, 13, "'ball' next to 'box'"));
  EXPECT_TRUE(is_only_mistake(mistakes_of("{colour: blue}", schema), 1, 4,
                              "exactly one of these keys is needed: box, ball"));
  EXPECT_TRUE(has_mistake(mistakes_of("{bax: 1}", schema), 1, 5, "did you mean 'box'?"));
}

TEST(SchemaAny, IsParsedLater) {
  const Value value = value_of("\n  name: ego\n  sped: 1 m/s\n", Schema::any());
  EXPECT_EQ(value.kind(), Kind::any);
  Diagnostics diagnostics;
  EXPECT_FALSE(parse_value(value, car(), diagnostics));
  EXPECT_TRUE(is_only_mistake(diagnostics, 3, 3, "unknown key 'sped'; did you mean 'speed'?"));
  Diagnostics none;
  const auto parsed = parse_value(value_of("{name: ego}", Schema::any()), car(), none);
  ASSERT_TRUE(parsed) << none.to_text();
  EXPECT_EQ((*parsed)["name"].text(), "ego");
}

TEST(SchemaAny, DefaultHasThePlaceOfItsRecord) {
  const Schema outer = Schema::record({Field::with_default("parameters", Schema::any(), "{}", "Open.")});
  Diagnostics diagnostics;
  const auto value = parse_text("f.yaml", "v:\n  {}\n", one(outer), diagnostics);
  ASSERT_TRUE(value) << diagnostics.to_text();
  EXPECT_FALSE(parse_value((*value)["v"]["parameters"], car(), diagnostics));
  EXPECT_TRUE(is_only_mistake(diagnostics, 2, 3, "missing key 'name'"));
}

TEST(ValuePlaces, PointIntoText) {
  const Value plain = value_of("abc def", Schema::text());
  EXPECT_EQ(plain.place_in_text(4), (Place{"f.yaml", 1, 8}));
  const Value in_double = value_of(R"("a\"b c")", Schema::text());
  EXPECT_EQ(in_double.text(), "a\"b c");
  EXPECT_EQ(in_double.place_in_text(2), (Place{"f.yaml", 1, 8}));
  EXPECT_EQ(in_double.place_in_text(4), (Place{"f.yaml", 1, 10}));
  const Value folded = value_of(">-\n  first\n  second\n", Schema::text());
  EXPECT_EQ(folded.text(), "first second");
  EXPECT_EQ(folded.place_in_text(6), (Place{"f.yaml", 3, 3}));
  const Value over_lines = value_of("first\n  second", Schema::text());
  EXPECT_EQ(over_lines.place_in_text(6), (Place{"f.yaml", 2, 3}));
}

TEST(Misuse, IsAsserted) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const Value number = value_of("1", Schema::integer(0, 9));
  EXPECT_DEATH(number.text(), "misuse: text\\(\\)");
  EXPECT_DEATH(value_of("{name: ego}", car())["nothing"], "misuse");
  const Schema ten = Schema::record({Field::with_default("v", Schema::integer(0, 9), "10", "Ten.")});
  EXPECT_DEATH(value_of("{}", ten), "out of range");
  EXPECT_DEATH(
      Schema::record({Field::needed("v", Schema::text(), "."), Field::needed("v", Schema::text(), ".")}),
      "different names");
}

}  // namespace
}  // namespace hil::config
