// A plug-in for tests: a module without a world, which contributes all that a module can.

#include <cmath>
#include <csignal>
#include <stdexcept>

#include <hil/plugin.hpp>

namespace pumps {

using namespace hil;

/// Its output is the flow in l/s.
class Pump final : public modules::Module {
 public:
  explicit Pump(const config::Value& parameters)
      : flow_(parameters["flow"].number()),
        throws_at_(parameters["throws_at"].integer()),
        crashes_at_(parameters["crashes_at"].integer()) {
    ports_.inputs = {{.name = "speed", .unit = "1/s", .about = "Turns per second", .initial = 1.0}};
    ports_.outputs = {{.name = "flow", .unit = "l/s", .about = "What it delivers"}};
  }

  const modules::Ports& ports() const noexcept override { return ports_; }
  void configure(const modules::Setup& setup) override {
    name_ = setup.task.instance;
    started_ = setup.events.add_kind("pump " + name_ + " delivers {} l/s");
    stream_ = setup.files.open({.folder = "files",
                                .owner = "pump " + name_,
                                .singular = "state",
                                .plural = "states",
                                .buffer_bytes = sizeof(double),
                                .encoder = std::make_shared<Encoder>(name_)});
  }
  void step(modules::StepContext& context) override {
    if (throws_at_ >= 0 && context.run == static_cast<std::uint64_t>(throws_at_))
      throw std::runtime_error("the pump is dry");
    if (crashes_at_ >= 0 && context.run == static_cast<std::uint64_t>(crashes_at_)) std::raise(SIGSEGV);
    context.outputs[0] = flow_ * context.inputs[0].value;
    if (context.run == 0) context.events->note(started_, context.time_ns, context.outputs[0]);
    if (context.run % 10 != 0) return;
    const std::span<std::byte> buffer = stream_->begin();
    if (buffer.empty()) return;
    const std::span bytes = std::as_bytes(std::span(context.outputs.data(), 1));
    std::copy(bytes.begin(), bytes.end(), buffer.begin());
    stream_->finish(sizeof(double), context.time_ns);
  }
  void contribute(contribution::Contribution& report) const override {
    contribution::Section& section = report.section("Pumps");
    section.name = "pumps";
    section.plots.push_back({.title = "Flow of " + name_,
                             .x = {.quantity = "speed", .unit = "1/s"},
                             .y = {.quantity = "flow", .unit = "l/s"},
                             .series = {{.name = "flow", .points = {{1.0, flow_}, {2.0, 2.0 * flow_}}}},
                             .bars = true});
    section.tables.push_back(
        {.columns = {{.title = "Pump"}, {.title = "Flow", .numeric = true, .unit = "l/s"}},
         .rows = {{{.text = name_}, {.number = flow_}}}});
    report.map.tracks.push_back({.name = name_, .points = {{0, 0.0, 0.0}, {report.end_ns, 1.0, 2.0}}});
    report.files.push_back({name_ + ".csv", "speed,flow\n1," + std::to_string(flow_) + "\n"});
    report.lists.push_back({.list = "pumps", .name = name_, .properties = {{"flow", flow_}}});
  }

 private:
  struct Encoder final : modules::FileEncoder {
    explicit Encoder(std::string name) : name_(std::move(name)) {}
    void encode(std::span<std::byte> buffer, std::int64_t time_ns, modules::FileOutput& files) override {
      files.write(name_ + "-" + std::to_string(time_ns / 1'000'000) + ".bin", buffer);
    }
    std::string name_;
  };

  const double flow_;
  const std::int64_t throws_at_, crashes_at_;
  modules::Ports ports_;
  std::string name_;
  modules::EventLog::Kind started_;
  std::unique_ptr<modules::FileStream> stream_;
};

modules::ModuleType pump_type() {
  using config::Field;
  using config::Schema;
  return {.name = "pump",
          .about = "A pump that delivers in proportion to its speed.",
          .parameters = Schema::record({
              Field::with_default("flow", Schema::number(0.0, 100.0), "2", "Litres of a turn."),
              Field::with_default("throws_at", Schema::integer(-1, 1'000'000), "-1",
                                  "The run in which its step throws."),
              Field::with_default("crashes_at", Schema::integer(-1, 1'000'000), "-1",
                                  "The run in which its step ends by a signal."),
          }),
          .create = [](const config::Value& parameters, const modules::TaskParameters& /*task*/,
                       config::Diagnostics& /*diagnostics*/) -> std::unique_ptr<modules::AnyModule> {
            return std::make_unique<Pump>(parameters);
          }};
}

}  // namespace pumps

HIL_PLUGIN("pumps", "1.2.3", pumps::pump_type())
