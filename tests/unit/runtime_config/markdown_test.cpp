#include "config_fixture.hpp"
#include "runtime/buses/bus.hpp"
#include "runtime/buses/modbus/modbus_schema.hpp"
#include "runtime/config/schema_markdown.hpp"
#include "runtime/expectations/kinds.hpp"

namespace hil::config {
namespace {

TEST(Markdown, DescribesEveryKindOfKey) {
  const Schema schema = Schema::record({
      Field::needed("rate", Schema::quantity(Quantity::frequency_hz, 1.0, 1000.0), "How often."),
      Field::with_default("clock", Schema::one_of({"wall", "virtual"}), "wall", "Which clock."),
      Field::optional("cars",
                      Schema::list(Schema::record({Field::needed("name", Schema::name(), "Its name.")}), 1),
                      "The cars."),
      Field::optional("inputs", Schema::map(Schema::signal()), "The inputs."),
      Field::optional(
          "m",
          Schema::choice("type",
                         {{"x", Schema::record({Field::optional("k", Schema::integer(0, 9), "K.")})}}),
          "M."),
  });
  EXPECT_EQ(schema_to_markdown(schema),
            "- `rate` (frequency with its unit (Hz, kHz, MHz), from 1 Hz to 1000 Hz; needed): How often.\n"
            "- `clock` (one of: wall, virtual; default `wall`): Which clock.\n"
            "- `cars` (list of at least 1 of: keys): The cars.\n"
            "  - `name` (name; needed): Its name.\n"
            "- `inputs` (a name of your own for each: signal's name): The inputs.\n"
            "- `m` (keys that depend on `type`): M.\n"
            "  - with `type: x`\n"
            "    - `k` (whole number, from 0 to 9): K.\n");
}

TEST(Markdown, OfTheScenarioDescribesEveryKeyInASentence) {
  const std::string text =
      schema_to_markdown(scenario_schema(
          {.modules = {}, .buses = buses::section_types(), .expectations = expectations::kinds()})) +
      schema_to_markdown(buses::modbus::register_map_schema());
  for (const char* key : {"base_rate", "lock_memory", "quaternion", "retained_changes", "overrun", "checksum",
                          "corrupt", "heartbeat", "safe_on_exit", "at_least", "cycle_time", "after_shift",
                          "settling_time", "word_order", "dut", "base_color", "illuminance", "luminance"}) {
    EXPECT_NE(text.find("- `" + std::string(key) + "` ("), std::string::npos) << key;
  }
  std::istringstream lines(text);
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    if (line.find("- with `") != std::string::npos) continue;  // the head of an alternative
    EXPECT_TRUE(line.ends_with(".")) << line;
    EXPECT_NE(line.find("): "), std::string::npos) << line;
  }
  EXPECT_GT(count, 90);
}

}  // namespace
}  // namespace hil::config
