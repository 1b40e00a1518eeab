// Plug-ins in a program that is no hil: two in one process, and those that can not be loaded.

#include "runtime/plugins/plugins.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "runtime/config/parse.hpp"
#include "runtime/modules/registry.hpp"
#include "runtime/modules/run_events.hpp"
#include "tests/paths.h"

namespace hil::plugins {
namespace {

namespace fs = std::filesystem;

const fs::path folder = HIL_BINARY_DIR "/tests/plugins";

std::string fault_of(const fs::path& file) {
  std::string fault;
  EXPECT_FALSE(load_plugin(file, fault));
  return fault;
}

struct NoFiles final : modules::FileStreams {
  struct Stream final : modules::FileStream {
    std::span<std::byte> begin() noexcept override { return {}; }
    void finish(std::size_t /*bytes*/, std::int64_t /*time_ns*/) noexcept override {}
    modules::FileStreamRecord record() const override { return {}; }
  };
  std::unique_ptr<modules::FileStream> open(const modules::FileStreamOptions& /*options*/) override {
    return std::make_unique<Stream>();
  }
};

TEST(Plugins, TwoAddTheirModuleTypes) {
  std::string fault;
  const auto pump = load_plugin(folder / "pump.so", fault);
  ASSERT_TRUE(pump) << fault;
  EXPECT_EQ(pump->types, std::vector<std::string>{"pump"});
  const auto docking = load_plugin(HIL_BINARY_DIR "/plugins/docking.so", fault);
  ASSERT_TRUE(docking) << fault;
  EXPECT_EQ(docking->types, (std::vector<std::string>{"docking_port", "pixel_study"}));
  EXPECT_EQ(plugin_of("pump"), "pumps");
  EXPECT_EQ(plugin_of("pixel_study"), "docking");
  EXPECT_EQ(plugin_of("block"), "");
  // Again, and by another path: nothing new.
  const std::size_t types = modules::module_types().size();
  ASSERT_TRUE(load_plugin(folder / "../plugins/pump.so", fault)) << fault;
  EXPECT_EQ(modules::module_types().size(), types);
}

TEST(Plugins, AModuleOfOneIsSteppedAsAnyOther) {
  std::string fault;
  ASSERT_TRUE(load_plugin(folder / "pump.so", fault)) << fault;
  const modules::ModuleType& type = *modules::find_module_type("pump");
  config::Diagnostics diagnostics;
  const auto parameters = config::parse_text("p.yaml", "{flow: 3}", type.parameters, diagnostics);
  ASSERT_TRUE(parameters) << diagnostics.to_text();
  EXPECT_EQ((*parameters)["throws_at"].integer(), -1) << "a default of its schema";
  const modules::TaskParameters task{.instance = "p", .period_ns = 1'000'000};
  const auto module = type.create(*parameters, task, diagnostics);
  ASSERT_NE(module, nullptr);
  modules::RunEvents events;
  NoFiles files;
  module->plain_module()->configure({.task = task, .events = events, .files = files});
  const std::vector<signals::SignalValue> inputs{{.value = 4.0, .time_ns = 0, .fresh = true}};
  std::vector<double> outputs(1);
  modules::StepContext context;
  context.inputs = inputs;
  context.outputs = outputs;
  context.events = &events;
  module->plain_module()->step(context);
  EXPECT_EQ(outputs[0], 12.0);
  ASSERT_EQ(events.events().size(), 1U);
  EXPECT_EQ(events.events()[0].text, "pump p delivers 12.0 l/s");
  EXPECT_FALSE(config::parse_text("p.yaml", "{flow: 300}", type.parameters, diagnostics));
  EXPECT_NE(diagnostics.to_text().find("out of range"), std::string::npos) << diagnostics.to_text();
}

TEST(Plugins, ThoseThatCanNotBeLoadedSayWhy) {
  EXPECT_NE(fault_of(folder / "same_name.so").find("the module type 'block' is one of hil"),
            std::string::npos);
  EXPECT_NE(fault_of(folder / "no_entry.so").find("it has no function hil_plugin_types"), std::string::npos);
  EXPECT_NE(fault_of(folder / "undefined.so").find("undefined symbol"), std::string::npos);
  EXPECT_NE(fault_of(folder / "other_abi.so").find("compile it again"), std::string::npos);
  EXPECT_NE(fault_of(HIL_SOURCE_DIR "/README.md").find("it is no ELF file"), std::string::npos);
}

TEST(Plugins, AreSearchedInThePathFirst) {
  std::string fault;
  ASSERT_EQ(::setenv("HIL_PLUGIN_PATH", ("/nowhere::" + folder.string()).c_str(), 1), 0);
  EXPECT_EQ(find_plugin("pump", "/", fault), folder / "pump.so");
  EXPECT_EQ(find_plugin("docking", "/", fault), fs::path(HIL_BINARY_DIR "/plugins/docking.so"))
      << "beside the folder of the program";
  EXPECT_FALSE(find_plugin("nothing", "/", fault));
  EXPECT_NE(fault.find("there is no plug-in 'nothing' (nothing.so) in /nowhere, "), std::string::npos);
  EXPECT_EQ(find_plugin("plugins/pump.so", HIL_BINARY_DIR "/tests", fault), folder / "pump.so");
  EXPECT_FALSE(find_plugin("./pump.so", "/", fault));
  ASSERT_EQ(::unsetenv("HIL_PLUGIN_PATH"), 0);
  EXPECT_FALSE(find_plugin("pump", "/", fault));
}

}  // namespace
}  // namespace hil::plugins
