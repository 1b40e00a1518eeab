#include "runtime/modules/block/block_schema.hpp"

#include "runtime/expression/table.hpp"

namespace hil::modules {
namespace {

using config::Field;
using config::Schema;

Schema input_schema() {
  return Schema::record_or(
      "unit",
      {
          Field::with_default("unit", Schema::text(), "'1'",
                              "The unit in which the block reads it. The signal's unit is converted."),
          Field::optional("initial", Schema::text(),
                          "The value while no signal is connected. Left out: one must be connected."),
          Field::with_default("values", Schema::map(Schema::number(-1e15, 1e15)), "{}",
                              "Names of values, for comparisons."),
      });
}

Schema state_schema() {
  const Schema reset = Schema::record({
      Field::needed("when", Schema::text(), "A condition. In a step in which it is true, the state is set."),
      Field::needed("to", Schema::text(), "The value that the state is set to."),
  });
  return Schema::record({
      Field::with_default("initial", Schema::text(), "0",
                          "The value in the first step: of parameters alone."),
      Field::optional("unit", Schema::text(), "The unit of the state. Left out: that of 'initial'."),
      Field::optional("derivative", Schema::text(), "The change per second, which is integrated."),
      Field::optional("next", Schema::text(),
                      "The value in the next step, in place of a derivative. Without either, the state keeps "
                      "its value until a reset or an entry action sets it."),
      Field::optional("min", Schema::text(), "The least value: the state stops there."),
      Field::optional("max", Schema::text(), "The largest value: the state stops there."),
      Field::optional("reset", reset, "Sets the state."),
  });
}

Schema value_schema() {
  return Schema::record_or(
      "value", {
                   Field::needed("value", Schema::text(), "The expression."),
                   Field::optional("unit", Schema::text(), "The unit. Left out: that of the expression."),
               });
}

Schema machine_schema() {
  const Schema transition = Schema::record({
      Field::needed("to", Schema::name(), "The state to which it leads."),
      Field::optional("when", Schema::text(),
                      "The guard, a condition. Its functions with a memory begin when the state is entered."),
      Field::optional("after", Schema::text(),
                      "The least time in the state. With a guard, the guard has to be true as well."),
  });
  const Schema state = Schema::record({
      Field::with_default("entry", Schema::map(Schema::text()), "{}",
                          "States of the block that are set when the state is entered, with their values."),
      Field::with_default("transitions", Schema::list(transition, 0, 100), "[]",
                          "The ways out. In each step, the first one that is permitted is taken."),
  });
  return Schema::record({
      Field::optional("initial", Schema::name(), "The state at the start. Left out: the first one."),
      Field::needed("states", Schema::map(state), "The states by name, at least two."),
      Field::with_default("events", Schema::boolean(), "true",
                          "Whether each transition is an event of the report."),
  });
}

}  // namespace

Schema block_schema() {
  return Schema::record({
      Field::with_default("parameters", Schema::map(Schema::text()), "{}",
                          "Constants by name, as '2 m2', or computed from other ones."),
      Field::with_default("tables", Schema::map(expression::Table::schema()), "{}",
                          "Functions by name that are given by their values at points."),
      Field::with_default("inputs", Schema::map(input_schema()), "{}",
                          "Inputs by name: the unit, or a record. 'name.fresh' is whether the value is "
                          "known."),
      Field::with_default("states", Schema::map(state_schema()), "{}", "Values with a memory, by name."),
      Field::with_default("variables", Schema::map(value_schema()), "{}",
                          "Expressions by name, of which others are made, in any order."),
      Field::with_default("state_machines", Schema::map(machine_schema()), "{}",
                          "State machines by name. 'machine == state' is whether it is in the state, "
                          "'machine.time' how long it has been."),
      Field::optional("outputs", Schema::map(value_schema()),
                      "Outputs by name. Left out: all states, variables and machines."),
      Field::with_default(
          "integrator", Schema::one_of({"rk4", "euler"}), "rk4",
          "How derivatives are integrated from step to step: the classical method of Runge and "
          "Kutta of order 4, or Euler's."),
  });
}

}  // namespace hil::modules
