// Relations of bodies in expressions: their names, types and mistakes.

#include "runtime/expression/relation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "compiled.hpp"
#include "runtime/config/parse.hpp"
#include "tests/paths.h"

namespace hil::expression {
namespace {

using test::Names;

config::Expression parsed(const std::string& written) {
  config::Diagnostics diagnostics;
  auto expression = config::Expression::parse(config::Word{written, {"test", 1, 1}}, diagnostics);
  EXPECT_TRUE(expression) << diagnostics.to_text();
  return *expression;
}

/// A world in which a distance is 4 m, a time to impact 1.5 s, and all else true.
Names world() {
  Names names;
  names.all = {{"distance(ego, rock)", "m", 4.0},
               {"contact(ego, rock)", "", 1.0},
               {"time_to_impact(ego, rock)", "s", 1.5},
               {"time_to_impact(ego, rock, 2 s)", "s", 1.5},
               {"inside(ego, gate)", "", 1.0},
               {"crossed_at(ego, gate)", "s", 2.5},
               {"gap", "m", 7.0}};
  return names;
}

std::optional<Program> compile(const std::string& written, const ResultSpec& spec, std::string& mistakes) {
  config::Diagnostics diagnostics;
  auto program = Program::compile(parsed(written), world(), spec, {}, diagnostics);
  mistakes = diagnostics.to_text();
  return program;
}

double value(const std::string& written, const ResultSpec& spec) {
  std::string mistakes;
  auto program = compile(written, spec, mistakes);
  EXPECT_TRUE(program) << mistakes;
  return program ? program->evaluate(world().values(), 0.0) : test::unknown;
}

TEST(Relations, AreValuesWithUnitsAndTruths) {
  EXPECT_EQ(value("distance(ego, rock)", {.unit = "cm"}), 400.0);
  EXPECT_EQ(value("gap - distance( ego ,rock )", {.unit = "m"}), 3.0);
  EXPECT_EQ(value("distance(ego, rock) < 5 m and contact(ego, rock)", {.truth = true}), 1.0);
  EXPECT_EQ(value("not contact(ego, rock)", {.truth = true}), 0.0);
  EXPECT_EQ(value("inside(ego, gate)", {.truth = true}), 1.0);
  EXPECT_EQ(value("crossed_at(ego, gate) - 500 ms", {.unit = "ms"}), 2000.0);
  EXPECT_EQ(value("min(distance(ego, rock), gap) / time_to_impact(ego, rock)", {.unit = "m/s"}), 4.0 / 1.5);
  EXPECT_EQ(value("time_to_impact(ego, rock, 2000 ms) < 2 s", {.truth = true}), 1.0);
}

TEST(Relations, ReadOneSignalEach) {
  EXPECT_EQ(names_read(parsed("gap < distance(ego, rock) + gap").nodes()),
            (std::vector<std::string>{"gap", "distance(ego, rock)", "gap"}));
  EXPECT_EQ(names_read(parsed("time_to_impact(gap,x,500 ms) < 1").nodes()),
            std::vector<std::string>{"time_to_impact(gap, x, 0.5 s)"});
  EXPECT_EQ(names_read(parsed("time_to_impact(a, b, 10 s) < 1").nodes()),
            std::vector<std::string>{"time_to_impact(a, b)"});
}

TEST(Relations, MistakesHaveTheirPlaces) {
  const struct {
    std::string written, mistake;
  } all[] = {
      {"distance(ego) < 5 m", "test:1:1: 'distance' has 1 argument, but takes (body, other)"},
      {"contact(ego, rock, gap)", "test:1:1: 'contact' has 3 arguments, but takes (body, other)"},
      {"distance(ego, 2 m) < 5 m", "test:1:15: 'distance' takes names: (body, other)"},
      {"inside(ego, 'gate')", "test:1:13: 'inside' takes names: (body, region)"},
      {"distance(ego, ego) < 5 m",
       "test:1:15: 'ego' is both arguments of 'distance'; name two different ones"},
      {"distance(ego, rock) < 5 s", "test:1:21: '<' has operands in m and s"},
      {"time_to_impact(ego, rock, 20 s) < 5 s",
       "test:1:27: the window of 'time_to_impact' is a constant duration above 0 s and of at most 10 s, as "
       "'2 s'"},
      {"time_to_impact(ego, rock, gap) < 5 s",
       "test:1:27: the window of 'time_to_impact' is a constant duration above 0 s and of at most 10 s, as "
       "'2 s'"},
      {"time_to_impact(ego, rock) < 11 s",
       "test:1:29: impacts are searched 10 s ahead, so this comparison has one result with and without an "
       "impact; "
       "compare with a time below 10 s"},
      {"2 s >= time_to_impact(ego, rock, 2 s)",
       "test:1:1: impacts are searched 2 s ahead, so this comparison has one result with and without an "
       "impact; "
       "compare with a time below 2 s, or give a longer window"},
      {"contact(ego, wall)",
       "test:1:1: 'contact(ego, wall)' is known only to variables, stimuli, faults and expectations of a "
       "scenario; give it to a variable there"},
      {"distanc(ego, gap) < 5 m", "test:1:1: there is no function 'distanc'; did you mean 'distance'?"},
      {"distance < 5 m", "test:1:1: the function 'distance' needs its arguments in parentheses"},
  };
  for (const auto& [written, mistake] : all) {
    std::string mistakes;
    EXPECT_FALSE(compile(written, {.truth = true}, mistakes)) << written;
    EXPECT_EQ(mistakes, mistake + "\n") << written;
  }
}

TEST(Relations, AComparisonWithTheWindowCanSeparateAnImpactFromNone) {
  for (const char* const written :
       {"time_to_impact(ego, rock, 2 s) < 2 s", "time_to_impact(ego, rock, 2 s) >= 2 s",
        "2 s > time_to_impact(ego, rock, 2 s)", "time_to_impact(ego, rock, 2 s) <= 1.9 s"}) {
    std::string mistakes;
    EXPECT_TRUE(compile(written, {.truth = true}, mistakes)) << written << ": " << mistakes;
  }
}

TEST(Relations, AreDescribedInTheGuide) {
  std::ifstream file(HIL_SOURCE_DIR "/docs/guide/expressions.md");
  const std::string guide(std::istreambuf_iterator<char>(file), {});
  for (const RelationFunction& function : relation_functions()) {
    const std::string row = "| `" + std::string(function.name) + "(" + std::string(function.arguments) +
                            ")` | " + std::string(function.about) + " |\n";
    EXPECT_NE(guide.find(row), std::string::npos) << row;
  }
}

}  // namespace
}  // namespace hil::expression
