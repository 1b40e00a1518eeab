#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <hil/module.hpp>

#include "runtime/buses/bus.hpp"
#include "runtime/cli/flush_output.hpp"
#include "runtime/cli/subcommands.hpp"
#include "runtime/config/parts_file.hpp"
#include "runtime/config/schema_markdown.hpp"
#include "runtime/modules/registry.hpp"
#include "runtime/plugins/plugins.hpp"
#include "runtime/run/session.hpp"
#include "runtime/run/wiring.hpp"

namespace hil::cli {

void add_keys(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("keys", "print every key of a scenario and of a register map, in Markdown");
  auto names = std::make_shared<std::vector<std::string>>();
  command->add_option("--plugin", *names, "a plug-in, whose module types are listed too: a name or a path")
      ->take_all();
  command->callback([names, &exit_code] {
    for (const std::string& name : *names) {
      std::string fault;
      const auto path = plugins::find_plugin(name, std::filesystem::current_path(), fault);
      if (path && plugins::load_plugin(*path, fault)) continue;
      std::fprintf(stderr, "hil keys: %s\n", fault.c_str());
      exit_code = run::exit_bad_config;
      return;
    }
    std::printf("# Keys of a scenario\n\n%s\n",
                config::schema_to_markdown(config::scenario_schema(run::scenario_types())).c_str());
    std::printf("\n# Files of parts, for `shape: {parts: ...}`\n\n%s\n",
                config::schema_to_markdown(config::parts_file_schema()).c_str());
    for (const modules::ModuleType& type : modules::module_types()) {
      std::printf("\n# Parameters of module type `%s`\n\n%s\n\n%s\n", type.name.c_str(), type.about.c_str(),
                  config::schema_to_markdown(type.parameters).c_str());
    }
    for (const buses::BusType& type : buses::bus_types()) {
      for (const buses::FileFormat& format : type.files)
        std::printf("\n# %s\n\n%s\n", format.title.c_str(),
                    config::schema_to_markdown(format.schema).c_str());
    }
    exit_code = flush_output("keys", run::exit_passed);
  });
}

}  // namespace hil::cli
