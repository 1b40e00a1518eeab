// Test tables in a run that is stepped, and damaged ones.

#include "injection_fixture.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/text_mutator.hpp"

namespace hil::injection {
namespace {

const std::string table_rows =
    "time,signal,value,fault,expectation,tolerance\n"
    "0.002,control.u,1 m,,,\n"
    "0.0035,control.u,3,,,\n"
    "0.004,plant.x,,stuck,,\n"
    "0.005,control.t,21,,,\n"
    "0.006,plant.x,,gain 2,6,0.5\n"
    "0.008,plant.x,,delay 2 ms,8,0 m\n"
    "0.01,plant.x,,none,,\n";

class TestTableInjection : public test::InjectionFixture {
 protected:
  void open_table(const std::string& rows) {
    folder_.write("t.csv", rows);
    open("test_tables: [{name: t, file: t.csv}]\n");
  }
};

TEST_F(TestTableInjection, ActsInTheFirstTickNotBeforeARow) {
  open_table(table_rows);
  std::string values, seen;
  for (int tick = 0; tick <= 11; ++tick) {
    run_to(tick);
    values += std::to_string(static_cast<int>(value("control.u"))) + " ";
    seen += std::to_string(static_cast<int>(read("w").value)) + " ";
  }
  EXPECT_EQ(values, "5 5 1 1 3 3 3 3 3 3 3 3 ");
  EXPECT_EQ(seen, "0 1 2 3 3 3 12 14 12 14 10 11 ")
      << "stuck from 4 on, doubled from 6 on, from 8 to 10 as it was read 2 ms before";
  EXPECT_EQ(events(),
            (std::vector<std::string>{
                "2: stimulus t.control.u begins", "4: fault t.line_4 begins: plant.x stuck at its last value",
                "5: stimulus t.control.t begins", "6: fault t.line_4 ends",
                "6: fault t.line_6 begins: plant.x multiplied by 2", "8: fault t.line_6 ends",
                "8: fault t.line_7 begins: plant.x delayed by 2 ms", "10: fault t.line_7 ends"}));
}

TEST_F(TestTableInjection, DamagedIsRunOrRefusedAtALine) {
  std::uint64_t accepted = 0, refused = 0;
  const std::uint64_t rounds = tests::rounds(1000);
  for (std::uint64_t seed = 0; seed < rounds; ++seed) {
    time_ns_ = 0;
    try {
      open_table(tests::TextMutator(seed).mutate(table_rows));
      run_to(12);
      ++accepted;
    } catch (const std::runtime_error&) {
      ASSERT_FALSE(diagnostics_.empty()) << "seed " << seed;
      for (const config::Mistake& mistake : diagnostics_.mistakes())
        ASSERT_GE(mistake.place.line, 1U) << "seed " << seed << ": " << mistake.message;
      ++refused;
    }
  }
  EXPECT_GT(accepted, rounds / 40);
  EXPECT_GT(refused, rounds / 10);
}

}  // namespace
}  // namespace hil::injection
