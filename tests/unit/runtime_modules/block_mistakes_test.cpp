// Mistakes in blocks: each gives one sentence at its place.

#include <algorithm>
#include <array>
#include <cmath>

#include "block_run.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/text_mutator.hpp"

namespace hil::modules {
namespace {

std::string mistakes_of(const std::string& yaml) {
  config::Diagnostics diagnostics;
  test::create_block(yaml, diagnostics);
  return diagnostics.to_text();
}

TEST(BlockMistakes, AreReportedWithTheirPlaces) {
  const struct {
    std::string yaml, mistake;
  } all[] = {
      {"integrator: rk4", "b.yaml:1:1: the block has no outputs, states, variables or state machines"},
      {"states: {x: {initial: 1 m, derivative: 2 kg}}",
       "b.yaml:1:40: the derivative of 'x' is in m/s; this is in kg"},
      {"states: {x: {initial: 1 m, derivative: spede}}",
       "b.yaml:1:40: there is no input, parameter, state or variable 'spede'; known here: x"},
      {"states: {x: {initial: 1 m, unit: s}}", "b.yaml:1:23: 'x' is in s; this is in m"},
      {"states: {x: {initial: 1 m, unit: metre}}", "b.yaml:1:34: 'metre' is not a known unit"},
      {"states: {x: {initial: y}, y: {initial: 1}}", "b.yaml:1:23: there is no parameter 'y'"},
      {"states: {x: {initial: 3 m, max: 2 m}}", "b.yaml:1:23: 'x' begins at 3 m, but its 'max' is 2 m"},
      {"states: {x: {initial: 3 m, min: p}}\nparameters: {p: 4 m}",
       "b.yaml:1:23: 'x' begins at 3 m, but its 'min' is 4 m"},
      {"states: {x: {derivative: 1 Hz, next: 2}}",
       "b.yaml:1:10: 'x' has a derivative and a next value; a state has one of them"},
      {"states: {x: {reset: {when: 3 m, to: 1}}}",
       "b.yaml:1:28: 'when' has to be true or false; this is a value in m"},
      {"states: {time: {}}",
       "b.yaml:1:10: 'time' is a word of the expression language; give the state another name"},
      {"states: {x: {}}\nvariables: {x: 1}",
       "b.yaml:2:13: the state in line 1 is also called 'x'; the names of a block are unique"},
      {"variables: {a: b + 1, b: c, c: a}",
       "b.yaml:1:13: a needs b needs c needs a: a value can not be computed from itself"},
      {"variables: {a: a}", "b.yaml:1:13: a needs a: a value can not be computed from itself"},
      {"variables: {a: 1 m + 1 s}", "b.yaml:1:20: '+' has operands in m and s"},
      {"variables: {a: {value: 1 m, unit: s}}", "b.yaml:1:24: 'a' is in s; this is in m"},
      {"parameters: {p: time}\nstates: {x: {}}", "b.yaml:1:17: parameter 'p' is constant, and 'time' is not"},
      {"parameters: {p: 1 / 0}\nstates: {x: {}}", "b.yaml:1:17: parameter 'p' has no finite value"},
      {"parameters: {p: 'delay(1, 1 s)'}\nstates: {x: {}}",
       "b.yaml:1:18: 'delay' needs steps of one period, which there are not here"},
      {"inputs: {u: metre}\noutputs: {u: u}", "b.yaml:1:13: 'metre' is not a known unit"},
      {"inputs: {u: {unit: m, initial: 1 s}}\noutputs: {u: u}", "b.yaml:1:32: 'u' is in m; this is in s"},
      {"tables: {max: {x: {points: [0, 1]}, values: [1, 2]}}\nstates: {x: {}}",
       "b.yaml:1:10: 'max' is a function; give the table another name"},
      {"tables: {t: {x: {points: [0, 2, 1]}, values: [1, 2, 3]}}\noutputs: {y: t(1)}",
       "b.yaml:1:33: the points of a table have to be strictly increasing, but 1 is not above the point "
       "before it"},
      {"tables: {t: {x: {points: [0, 1, 2]}, values: [1, 2]}}\noutputs: {y: t(1)}",
       "b.yaml:1:46: 2 values for 3 points of x"},
      {"tables: {t: {x: {points: [0, 1]}, rows: [[1, 2]]}}\noutputs: {y: t(1)}",
       "b.yaml:1:41: 'rows': a list of 1; expected at least 2"},
      {"tables: {t: {x: {points: [0, 1]}, rows: [[1, 2], [1, 2]]}}\noutputs: {y: t(1)}",
       "b.yaml:1:13: a table with 'rows' needs the points of 'y'"},
      {"tables: {t: {x: {points: [0, 1], unit: m}, values: [1, 2]}}\noutputs: {y: t(1 s)}",
       "b.yaml:2:16: the table 't' takes a value in m; this is in s"},
      {"tables: {t: {x: {points: [0, 1]}, values: [1, 2]}}\noutputs: {y: 't(1, 2)'}",
       "b.yaml:2:15: the table 't' takes one argument, not 2"},
      {"tables: {curve: {x: {points: [0, 1]}, values: [1, 2]}}\noutputs: {y: curv(1)}",
       "b.yaml:2:14: there is no function 'curv'; did you mean 'curve'?"},
      {"state_machines: {m: {states: {a: {}}}}", "b.yaml:1:18: a state machine has at least two states"},
      {"state_machines: {m: {initial: c, states: {a: {}, b: {}}}}",
       "b.yaml:1:31: the state machine 'm' has no state 'c'; known here: a, b"},
      {"state_machines: {m: {states: {a: {transitions: [{to: bb, after: 1 s}]}, b: {}}}}",
       "b.yaml:1:54: the state machine 'm' has no state 'bb'; did you mean 'b'?"},
      {"state_machines: {m: {states: {a: {transitions: [{to: b}]}, b: {}}}}",
       "b.yaml:1:49: a transition needs 'when', 'after' or both"},
      {"state_machines: {m: {states: {a: {transitions: [{to: b, after: 5}]}, b: {}}}}",
       "b.yaml:1:64: 'after' is a duration, as '20 ms'"},
      {"state_machines: {m: {states: {a: {entry: {x: 1}}, b: {}}}}",
       "b.yaml:1:43: an entry action sets a state of the block, and there is no state 'x'"},
      {"state_machines: {m: {states: {a: {entry: {x: count(x)}}, b: {}}}}\nstates: {x: {}}",
       "b.yaml:1:46: an entry action is computed once, so its functions have no memory; make a variable"},
      {"state_machines: {m: {states: {a: {}, b: {}}}}\noutputs: {y: m == c}",
       "b.yaml:2:19: 'c' is no number and no input, parameter, state or variable, and 'm' has no value"},
      {"outputs: {y: 1 +}", "b.yaml:1:17: the expression ends where"},
      {"state: {x: {}}", "unknown key 'state'; did you mean 'states'?"},
  };
  for (const auto& one : all) {
    const std::string mistakes = mistakes_of(one.yaml);
    EXPECT_NE(mistakes.find(one.mistake), std::string::npos) << one.yaml << "\n" << mistakes;
    EXPECT_EQ(std::count(mistakes.begin(), mistakes.end(), '\n'), 1) << one.yaml << "\n" << mistakes;
  }
}

TEST(BlockMistakes, OfOneDefinitionAreNotReportedWhereItIsUsed) {
  EXPECT_EQ(mistakes_of("parameters: {p: 1 m + 1 s, q: 2 * p}\ninputs: {u: metre}\n"
                        "tables: {t: {x: {points: [1, 0]}, values: [1, 2]}}\n"
                        "states: {x: {initial: q, derivative: v / u * t(x), max: p}}\n"
                        "variables: {v: x + w, w: q + y, y: 1 m == 1 s}\noutputs: {z: v + w}\n"),
            "b.yaml:1:21: '+' has operands in m and s\n"
            "b.yaml:2:13: 'metre' is not a known unit\n"
            "b.yaml:3:30: the points of a table have to be strictly increasing, but 0 is not above the point "
            "before it\n"
            "b.yaml:5:40: '==' has operands in m and s\n");
}

constexpr std::array originals{
    "parameters: {area: 2 m2, gain: 3 * k, k: 0.5}\n"
    "inputs: {u: {unit: '%', initial: 5}}\n"
    "states: {x: {initial: 1 m, derivative: gain * u / area * 1 m^3/s, min: 0, max: 3 m}}\n",
    "tables: {q: {x: {points: [0, 1]}, y: {points: [0, 1]}, rows: [[1, 2], [3, 4]], outside: unknown}}\n"
    "states: {n: {next: n + 1, reset: {when: rise(n > 3), to: 1}}}\n"
    "variables: {a: b * 2, b: \"q(n, time / 1 s)\", d: noise(1)}\n",
    "inputs: {gear: {unit: '1', initial: 0, values: {park: 0, drive: 1}}}\n"
    "states: {y: {unit: degC, initial: 20, derivative: (80 degC - y) / 1 min}}\n"
    "state_machines:\n"
    "  m: {states: {off: {entry: {y: 300 K}, transitions: [{to: on, when: gear == drive, after: 20 ms}]},\n"
    "       on: {transitions: [{to: off, after: 0.03 s}, {to: on, when: m.time > 1 s}]}}}\n",
};

TEST(BlockMutation, OfBlocksNeverCrashes) {
  std::uint64_t created = 0;
  const std::uint64_t rounds = hil::tests::rounds(4'000, 300'000);
  for (std::uint64_t seed = 0; seed < rounds; ++seed) {
    tests::TextMutator mutator(seed);
    const std::string original = originals[seed % originals.size()];
    const std::string text = seed < originals.size() ? original : mutator.mutate(original);
    config::Diagnostics diagnostics;
    if (test::create_block(text, diagnostics) == nullptr) continue;
    ++created;
    test::BlockRun run(text);
    for (int step = 0; step < 6; ++step) {
      run.step();
      for (const Port& port : run.ports().outputs)
        ASSERT_FALSE(std::isinf(run[port.name])) << text << port.name;
    }
  }
  EXPECT_GT(created, rounds / 40);
}

}  // namespace
}  // namespace hil::modules
