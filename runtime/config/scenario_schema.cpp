// The language of scenario files. The sentences become the documentation (schema_markdown.hpp).

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <hil/rotation.hpp>

#include "runtime/config/plugins_section.hpp"
#include "runtime/config/scenario.hpp"
#include "runtime/config/shared_schemas.hpp"
#include "runtime/config/test_table_file.hpp"
#include "runtime/config/text_lists.hpp"
#include "runtime/config/world_limits.hpp"

namespace hil::config {
namespace {

constexpr double min_recording_bytes = 0x1p20;

Schema size() {
  return Schema::quantity(Quantity::length_m, 1e-6, max_coordinate_m);
}
Schema vector3(Quantity quantity, double largest) {
  return Schema::list(Schema::quantity(quantity, -largest, largest), 3, 3);
}

/// The words on unsent outputs in the documentation of max_lost; empty when no type counts them.
std::string unsent_outputs_words(std::span<const BusSectionType> buses) {
  std::vector<std::string> nouns;
  for (const BusSectionType& type : buses) {
    if (type.counts_dropped_releases) nouns.push_back(type.noun);
  }
  return nouns.empty() ? "" : ", and of each " + text_list(nouns, "or") + "'s outputs that were not sent";
}

Schema realtime_schema(std::span<const BusSectionType> buses) {
  return Schema::record({
      Field::with_default(
          "scheduler", Schema::one_of({"fifo", "other"}), "fifo",
          "The Linux scheduling class of the base thread. What the machine refuses is reported as degraded."),
      Field::with_default("priority", Schema::integer(2, highest_priority), "60",
                          "The priority of the base thread under fifo. The database's engine thread has the "
                          "same priority, the GPU driver's threads two less, task threads one less and "
                          "lower, never below 1."),
      Field::with_default("lock_memory", Schema::boolean(), "true",
                          "Whether all memory of the program stays in RAM."),
      Field::with_default("cpus", Schema::list(Schema::integer(0, 1023), 0, 1024), "[]",
                          "The processors that the base thread and the task threads may run on. Empty: all."),
      Field::with_default("max_lost", Schema::quantity(Quantity::share, 0.0, 1.0), "5 %",
                          "The largest permitted share of skipped ticks, of each task's releases that were "
                          "skipped, aborted or left without a result of the database, of each task's runs "
                          "with a hard transaction after its deadline" +
                              unsent_outputs_words(buses) +
                              ". Above it the run's timing is broken (exit code 3)."),
      Field::optional("max_hard_misses", Schema::integer(0, 1'000'000'000),
                      "With more runs of tasks that have a hard transaction after its deadline, the run's "
                      "timing is broken (exit code 3). Modules write bodies by hard transactions. Left out: "
                      "max_lost alone is their limit."),
      Field::optional("watchdog", duration_schema(1e-3),
                      "The run ends, with outputs in their safe state, when the base thread completes no "
                      "tick for this time. Left out: the longer of 100 ms and 50 base periods."),
  });
}

Schema mesh_file_schema(const char* about_path) {
  return Schema::record_or("path",
                           {Field::needed("path", Schema::file(), about_path),
                            Field::with_default("scale", Schema::number(min_scale, max_scale), "1",
                                                "Metres per unit of the file. For millimetres: 0.001.")});
}

Schema shape_schema() {
  return Schema::exactly_one({
      Field::optional("box", Schema::list(size(), 3, 3), "The full sizes along x, y and z."),
      Field::optional("cylinder",
                      Schema::record({Field::needed("radius", size(), "The radius."),
                                      Field::needed("height", size(), "The full height, along z.")}),
                      "A cylinder along z."),
      Field::optional("sphere", Schema::record_or("radius", {Field::needed("radius", size(), "The radius.")}),
                      "A sphere."),
      Field::optional("rectangle", Schema::list(size(), 2, 2),
                      "The full sizes along x and y of a flat rectangle at z = 0."),
      Field::optional("file", mesh_file_schema("The path of the mesh: obj, stl, ply, gltf or glb."),
                      "A mesh from a file."),
      Field::optional("parts", Schema::file(),
                      "A file with a list of parts, which are boxes, cylinders, spheres and more, that make "
                      "one shape (docs/guide/scenario.md)."),
  });
}

Schema solid_schema() {
  const auto round = [](const char* about_height) {
    return Schema::record(
        {Field::needed("radius", size(), "The radius."), Field::needed("height", size(), about_height)});
  };
  return Schema::record({
      Field::needed(
          "shape",
          Schema::exactly_one({
              Field::optional("box", Schema::list(size(), 3, 3), "The full sizes along x, y and z."),
              Field::optional("sphere",
                              Schema::record_or("radius", {Field::needed("radius", size(), "The radius.")}),
                              "A sphere."),
              Field::optional("capsule", round("The distance of the centres of its ends."),
                              "A cylinder along z with half spheres at its ends."),
              Field::optional("cylinder", round("The full height."), "A cylinder along z."),
          }),
          "Its form and size."),
      Field::with_default("position", vector3(Quantity::length_m, max_coordinate_m), "[0 m, 0 m, 0 m]",
                          "Its centre in the frame of the shape."),
      Field::with_default("rotation", rotation_schema(), "{}", "Its rotation in that frame. Left out: none."),
  });
}

Schema field_schema() {
  return Schema::record({
      Field::optional(
          "error", size(),
          "The error of distances near the surface that 99 of 100 points do not exceed. Left out, "
          "without 'cell': 1/500 of the diagonal of the shape's box."),
      Field::optional("cell", size(), "The edge of the cells near the surface, in place of an error."),
      Field::with_default("sign", Schema::one_of({"automatic", "winding", "ray_ratio", "none"}), "automatic",
                          "How the inside is found. automatic: winding for a closed shape, else none."),
      Field::with_default("max_bytes", Schema::integer(1, max_field_bytes), "268435456",
                          "The largest memory on the device; a field that needs more is refused."),
  });
}

Schema entity_schema() {
  return Schema::record({
      Field::needed("name", Schema::name(), "The entity's name, unique in the world."),
      Field::optional("shape", shape_schema(),
                      "The form and size of the entity. Left out: none, for a light alone."),
      Field::with_default("position", vector3(Quantity::length_m, max_coordinate_m), "[0 m, 0 m, 0 m]",
                          "The position of the shape's origin in the world."),
      Field::with_default("rotation", rotation_schema(), "{}", "The rotation of the entity. Left out: none."),
      Field::with_default("velocity", vector3(Quantity::speed_mps, max_speed_mps), "[0 m/s, 0 m/s, 0 m/s]",
                          "The constant velocity in the world frame."),
      Field::with_default("angular_velocity", vector3(Quantity::angular_rate_radps, max_angular_rate_radps),
                          "[0 deg/s, 0 deg/s, 0 deg/s]",
                          "The constant angular velocity about the axes of the world frame."),
      Field::with_default("scale", Schema::number(min_scale, max_scale), "1",
                          "A factor on the shape's size."),
      Field::optional("field", field_schema(),
                      "A distance field of the shape, before 'scale'. Sensors with 'mode: fast' skip free "
                      "space by it. Left out: none."),
      Field::optional("convex_parts", mesh_file_schema("The path of the pieces: obj, ply, gltf or glb."),
                      "A mesh from a file (obj, ply, gltf or glb) of separate convex pieces, which contacts "
                      "with other bodies of convex pieces take in place of the shape. Left out: the convex "
                      "pieces of the shape, or its "
                      "triangles."),
      Field::optional("solid", solid_schema(),
                      "The exact shape of a body whose mesh approximates it, for contacts. Left out: of a "
                      "cylinder or a sphere the shape itself, of others none."),
      Field::optional("material", Schema::name(),
                      "The material, one of world.materials. Left out: matt, with the reflectance 1 and "
                      "the base colour 0.8."),
      Field::optional("light", Schema::name(),
                      "The light, one of world.lights, at the origin of the entity and along its x. Left "
                      "out: none."),
      Field::with_default("mask", Schema::list(Schema::name(), 1, Layers::capacity), "[static]",
                          "The layers of the entity. A query names the layers that it sees."),
  });
}

Field carrier_field() {
  return Field::optional(
      "carrier", Schema::text(),
      "The body in whose frame the place is and with which it moves. Left out: the world.");
}

Schema region_schema() {
  return Schema::record({
      Field::needed("name", Schema::name(),
                    "The name, for inside(body, region) and crossed_at(body, region) in expressions."),
      Field::needed("center", vector3(Quantity::length_m, max_coordinate_m), "Centre of the box."),
      Field::needed("size", Schema::list(Schema::quantity(Quantity::length_m, 0.001, max_coordinate_m), 3, 3),
                    "Full sizes of the box before its rotation."),
      Field::with_default("heading", Schema::quantity(Quantity::angle_rad, -6.3, 6.3), "0 deg",
                          "Rotation of the box about z."),
      Field::with_default(
          "whole", Schema::boolean(), "false",
          "true: the body's oriented bounds have to lie in the region completely. false: a part of them."),
      carrier_field(),
  });
}

Schema beam_schema() {
  const Schema angle = Schema::quantity(Quantity::angle_rad, -6.3, 6.3);
  return Schema::record({
      Field::needed("name", Schema::name(), "The name, for sees(beam, body) in expressions."),
      Field::with_default("origin", vector3(Quantity::length_m, max_coordinate_m), "[0 m, 0 m, 0 m]",
                          "Where the beam begins. It passes through its carrier."),
      Field::with_default("azimuth", angle, "0 deg", "From x towards y."),
      Field::with_default("elevation", angle, "0 deg", "Up from the plane of x and y."),
      Field::needed("range", Schema::quantity(Quantity::length_m, 0.001, max_coordinate_m),
                    "The length of the beam."),
      carrier_field(),
  });
}

Schema view_schema() {
  constexpr double degree = std::numbers::pi / 180.0;
  return Schema::record({
      Field::needed("name", Schema::name(), "The name of the view, in the report and for hil history."),
      carrier_field(),
      Field::needed("position", vector3(Quantity::length_m, max_coordinate_m), "Where the view is from."),
      Field::needed("look_at", vector3(Quantity::length_m, max_coordinate_m),
                    "The point in the middle of the image."),
      Field::with_default("field_of_view",
                          Schema::quantity(Quantity::angle_rad, 0.01 * degree, 179.0 * degree), "60 deg",
                          "Horizontal field of view."),
      Field::with_default("resolution", Schema::list(Schema::integer(1, 4096), 2, 2), "[640, 480]",
                          "Pixels in a row, and rows."),
      Field::with_default("mode", Schema::one_of({"real_time", "path_traced"}), "real_time",
                          "How colours are made, as of a camera."),
      Field::optional("samples", Schema::integer(1, 65536),
                      "Points or light paths of a pixel. Left out: 4, or 64 with mode path_traced."),
      Field::with_default("bounces", Schema::integer(0, 64), "1",
                          "Reflections before light reaches the view. With 2 or more, surfaces light each "
                          "other, which takes far longer."),
      Field::optional("exposure_value", Schema::number(-20.0, 30.0),
                      "Exposure value at ISO 100, as of a camera. Left out: by the brightness of the image."),
      Field::optional("layers", Schema::list(Schema::name(), 1, Layers::capacity),
                      "Layers whose bodies and lights the view shows. Left out: all."),
  });
}

Schema world_schema() {
  return Schema::record({
      Field::with_default("gpu", Schema::text(), "auto",
                          "The Vulkan device: a part of its name, its index in hil doctor, or auto."),
      Field::with_default("max_entities", Schema::integer(1, 1 << 20), "4096",
                          "The largest number of entities at one time."),
      Field::with_default("max_geometries", Schema::integer(1, 1 << 16), "1024",
                          "The largest number of geometries. Equal shapes share one."),
      Field::with_default("retained_changes", Schema::integer(1, 1 << 26), "65536",
                          "The number of written rows that are kept for readers of older versions."),
      Field::with_default("queue_capacity", Schema::integer(1, 1 << 16), "256",
                          "The largest number of waiting transactions."),
      Field::with_default("chunk", duration_schema(0.0, 1.0), "1 ms",
                          "About how long a transaction of higher priority waits for a large batch of "
                          "queries, which is split into chunks. 0 ms: batches are not split. Device time can "
                          "be reserved only for deadlines that are longer than this."),
      Field::with_default("durability", Schema::one_of({"volatile", "async", "group", "sync"}), "async",
                          "When a commit is on disk, in the run's folder. volatile: never; async: soon, and "
                          "the run does not wait; group: before its outcome; sync: before it can be read."),
      Field::with_default("flush_interval", duration_schema(0.0, 60.0), "10 ms",
                          "Under async: how long a commit waits for others that are written with it."),
      Field::with_default(
          "log_ring_bytes", Schema::integer(min_log_ring_bytes, max_log_ring_bytes), "16777216",
          "The size of the memory in which commits wait for the disk. When it is full, async continues "
          "without recording, which the report lists, and group and sync refuse writes."),
      Field::with_default("layers", Schema::list(Schema::name(), 0, Layers::capacity), "[]",
                          "The names of all layers. Empty: the layers that entities and modules name."),
      Field::with_default("materials", Schema::list(material_schema(), 0, max_added_materials), "[]",
                          "The surfaces that entities name."),
      Field::with_default("lights", Schema::list(light_schema(), 0, max_lights), "[]",
                          "The lights that entities name, for the images of cameras."),
      Field::with_default("entities", Schema::list(entity_schema()), "[]",
                          "The entities that exist from the first tick on."),
      Field::with_default("regions", Schema::list(region_schema()), "[]",
                          "Boxes in space, for conditions: inside(body, region), crossed_at(body, region)."),
      Field::with_default("beams", Schema::list(beam_schema()), "[]",
                          "Straight lines in space, for conditions: sees(beam, body)."),
      Field::with_default("views", Schema::list(view_schema(), 0, 16), "[]",
                          "Places from which the report shows the world at the end of the run."),
  });
}

Schema task_schema() {
  return Schema::record({
      Field::needed("module", Schema::name(), "The name of this instance. Its signals begin with it."),
      Field::needed("type", Schema::name(), "The module type."),
      Field::needed("rate", rate_schema(), "The rate of the task. It divides the base rate."),
      Field::with_default(
          "offset", duration_schema(0.0), "0 ms",
          "The shift of the releases: a multiple of the base period, less than the task's period."),
      Field::optional(
          "deadline", duration_schema(min_duration_s),
          "The time from a release by which the run has to end. Left out: one period of the task. With a "
          "thread of its own: a multiple of the base period, at which the outputs become visible."),
      Field::optional("budget", duration_schema(min_duration_s),
                      "The CPU time that one run may use. Left out: no limit."),
      Field::with_default("overrun", Schema::one_of({"skip", "queue", "abort"}), "skip",
                          "What happens at a release while the task still runs."),
      Field::with_default("warmup", Schema::integer(0, 1'000'000), "0",
                          "The number of first runs that are counted apart."),
      Field::optional("thread", Schema::name(),
                      "The name of the thread that runs the task; tasks with the same name share it. Left "
                      "out: the base thread."),
      Field::with_default("transactions", Schema::one_of({"soft", "firm"}), "soft",
                          "What becomes of a result of the database after the deadline, in a task that only "
                          "reads the world. soft: it is used. firm: it is discarded, and a query is refused "
                          "at once when its predicted cost does not fit before the deadline."),
      Field::with_default("parameters", Schema::any(), "{}", "The parameters of the module type."),
      Field::with_default("inputs", Schema::map_of_checked_names(Schema::signal()), "{}",
                          "The signal that feeds each input port."),
  });
}

Schema recording_schema() {
  return Schema::record_or(
      "enabled",
      {
          Field::with_default("enabled", Schema::boolean(), "true", "false: the run is not recorded."),
          Field::with_default("signals", Schema::list(Schema::text()), "['*']",
                              "The recorded signals: names, and patterns in which * stands for any "
                              "characters, as plant.*."),
          Field::with_default("frames", Schema::boolean(), "true",
                              "Whether the frames of the CAN buses are recorded."),
          Field::with_default("max_size", Schema::quantity(Quantity::data_bytes, min_recording_bytes, 0x1p40),
                              "1 GiB",
                              "The largest size of the file. The recording stops before it is larger, which "
                              "the report states."),
      });
}

/// Which placeholders stand for addresses. Empty: those of no type.
std::string meaning_of_placeholders(std::span<const BusSectionType> buses) {
  const std::string all = address_placeholders(buses);
  return all.empty() ? "" : all + " stand for the addresses of this run, ";
}

Schema process_schema(std::span<const BusSectionType> buses) {
  return Schema::record({
      Field::with_default("enabled", Schema::boolean(), "true", "false: the run does not start it."),
      Field::needed("command", Schema::list(Schema::text(), 1, 1000),
                    "The program and its arguments. " + meaning_of_placeholders(buses) +
                        "{clock} for wall or stepped."),
      Field::with_default("safe_on_exit", Schema::boolean(), "true",
                          "Whether outputs go to their safe values and the run ends when the process ends "
                          "before the run does."),
      may_be_lost_field("The process: with safe_on_exit: false, it ends before the run does."),
      Field::with_default(
          "free_running", Schema::boolean(), "false",
          "true permits, under clock: virtual, a process that can not keep step with the run: its command "
          "has none of " +
              run_time_placeholders(buses) + "."),
      Field::with_default(
          "start_timeout", duration_schema(1e-3, 3600.0), "5 s",
          "The longest wall-clock time until the process has connected to the virtual buses of its command."),
  });
}

Schema plot_schema() {
  return Schema::record({
      Field::needed("title", Schema::text(), "The plot's title."),
      Field::needed("signals", Schema::list(Schema::signal(), 1, max_plot_signals),
                    "The signals. Those of one unit share an axis; 'x.faulted' is drawn beside a signal x "
                    "that a fault acts on."),
      Field::optional("from", duration_schema(0.0), "The run time at which the plot begins. Left out: 0 s."),
      Field::optional("until", duration_schema(min_duration_s),
                      "The run time at which it ends. Left out: the end of the run."),
  });
}

}  // namespace

Schema scenario_schema(const ScenarioTypes& types) {
  const std::span<const BusSectionType> buses = types.buses;
  std::vector<Field> fields{
      Field::needed("scenario", Schema::text(), "The scenario's name."),
      Field::optional("about", Schema::text(), "A sentence about the scenario."),
      Field::with_default("base_rate", Schema::quantity(Quantity::frequency_hz, 1.0, 20e3), "1 kHz",
                          "The rate of the base tick. Its period is a whole number of nanoseconds."),
      Field::with_default("duration", duration_schema(1e-6), "10 s",
                          "The run time at which the run ends, a multiple of the base period."),
      Field::with_default("clock", Schema::one_of({"realtime", "virtual"}), "realtime",
                          "realtime: ticks follow the wall clock. virtual: ticks follow one another as fast "
                          "as they complete; two runs with one seed have the same results."),
      Field::with_default("seed", Schema::integer(0, std::numeric_limits<std::int64_t>::max()), "1",
                          "The seed of all random numbers of the run."),
      Field::with_default("trace", Schema::boolean(), "true",
                          "Whether the run writes trace.json, the ticks and steps of its last 10 s."),
      Field::with_default("realtime", realtime_schema(buses), "{}", "The scheduling of the run's threads."),
      Field::with_default("plugins", plugins_schema(), "[]",
                          "Libraries with module types. A name is that of NAME.so in a folder of "
                          "HIL_PLUGIN_PATH, in plugins/ or in lib/hil/plugins/ beside the folder of hil; one "
                          "with '/' is a path relative to this file."),
      Field::optional("include", Schema::list(Schema::file()),
                      "Files with parts of the scenario. Entries of their lists come first; where a file "
                      "includes another one and both have a value, its own counts."),
      Field::optional("set", Schema::map(Schema::any()),
                      "Paths with values, which change the included files as --set does: "
                      "{tasks.tank.rate: 100 Hz}."),
      Field::optional(
          "add", Schema::map(Schema::any()),
          "Paths with values that add names which the scenario defines itself, as an output of a block: "
          "{tasks.tank.parameters.outputs.low: 1}."),
      Field::with_default(
          "variables",
          Schema::map(Schema::record_or(
              "value",
              {
                  Field::needed("value", Schema::text(), "The expression."),
                  Field::optional("unit", Schema::text(), "The unit. Left out: that of the expression."),
              })),
          "{}",
          "Constants and values computed from signals at the end of each tick, by name. Each "
          "is a signal."),
      Field::with_default("world", world_schema(), "{}", "The shared world."),
      Field::with_default("tasks", Schema::list(task_schema()), "[]",
                          "The modules, in the order in which they run."),
  };
  for (const BusSectionType& type : buses)
    fields.push_back(Field::with_default(type.key, Schema::list(type.entry), "[]", type.about));
  fields.push_back(
      Field::optional("dut", process_schema(buses),
                      "The device under test, as a process of its own. Left out: a real one is attached."));
  fields.push_back(Field::with_default("processes", Schema::map(process_schema(buses)), "{}",
                                       "Other programs that the run starts and watches."));
  fields.push_back(Field::with_default("stimuli", stimuli_schema(types.waveforms), "[]",
                                       "Signals that drive inputs of modules and outputs of buses."));
  fields.push_back(Field::with_default("faults", faults_schema(types), "[]",
                                       "Faults of signals, messages, devices, processes and tasks."));
  fields.push_back(Field::with_default("test_tables", test_tables_schema(), "[]",
                                       "Values, faults and expectations at given run times, in CSV files."));
  fields.push_back(Field::with_default("expectations", expectations_schema(types), "[]",
                                       "The claims that have to hold for the run to pass."));
  fields.push_back(Field::optional(
      "recording", recording_schema(),
      "A file recording.mcap with signals, frames, events and deadline misses. Left out: none."));
  fields.push_back(Field::with_default("plots", Schema::list(plot_schema(), 0, max_plots), "[]",
                                       "Plots of signals in the report, beside those of the signals that "
                                       "expectations read."));
  return Schema::record(std::move(fields));
}

}  // namespace hil::config
