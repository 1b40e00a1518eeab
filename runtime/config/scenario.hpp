#pragma once
// A scenario as the rest of the program sees it: checked, complete, in SI units, immutable. Names that are
// looked up later, when the parts are wired together (a signal, a message of a bus), keep their place for
// error texts.
//
// Threads: immutable once loaded; any thread may read.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "runtime/config/bus_section.hpp"
#include "runtime/config/diagnostics.hpp"
#include "runtime/config/expectation_section.hpp"
#include "runtime/config/expression.hpp"
#include "runtime/config/fault_section.hpp"
#include "runtime/config/optics_section.hpp"
#include "runtime/config/schema.hpp"
#include "runtime/config/stimulus_section.hpp"

namespace hil::config {

enum class ClockKind : std::uint8_t { realtime, virtual_time };
enum class Scheduler : std::uint8_t { fifo, other };
enum class Overrun : std::uint8_t { skip, queue, abort };
/// When a commit is on disk (rtstdb/durability.hpp). none: `durability: volatile`.
enum class Durability : std::uint8_t { none, async, group, sync };

struct Realtime {
  Scheduler scheduler = Scheduler::fifo;
  int priority = 0;  ///< 2..98
  bool lock_memory = true;
  std::vector<int> cpus;         ///< empty: no affinity
  std::int64_t watchdog_ns = 0;  ///< 0: the executive's own choice
  double max_lost = 0.0;         ///< share of ticks, or of a task's releases, that may be lost
  std::optional<std::uint64_t> max_hard_misses{};  ///< runs of tasks with a late hard transaction
};

struct NoShape {};
/// Sizes are full extents in metres.
struct BoxShape {
  std::array<double, 3> size_m{};
};
struct CylinderShape {
  double radius_m = 0.0;
  double height_m = 0.0;  ///< along z
};
struct SphereShape {
  double radius_m = 0.0;
};
struct RectangleShape {
  std::array<double, 2> size_m{};  ///< in z = 0
};
struct FileShape {
  std::string path;    ///< absolute
  double scale = 1.0;  ///< of the file's coordinates
  Place place;
};
/// A list of parts (parts_file.hpp).
struct PartsShape {
  std::string path;  ///< absolute
  Place place;
};
using Shape =
    std::variant<NoShape, BoxShape, CylinderShape, SphereShape, RectangleShape, FileShape, PartsShape>;

/// The distance field of a shape (rtstdb/field.hpp), for sensors with `mode: fast`. Of the shape before the
/// entity's scale.
struct DistanceField {
  double error_m = 0.0;            ///< 0: the database's default
  double cell_m = 0.0;             ///< 0: by the error
  std::string sign = "automatic";  ///< rtstdb::to_string(FieldSign)
  std::uint64_t max_bytes = 0;
  auto operator<=>(const DistanceField&) const = default;  // NOLINT(modernize-use-nullptr): its 0 is none
};

/// The exact shape that a mesh approximates (rtstdb/solid.hpp), before the entity's scale.
struct SolidShape {
  std::string kind;                ///< rtstdb::to_string(SolidKind)
  std::array<double, 3> size_m{};  ///< of a box
  double radius_m = 0.0, height_m = 0.0;
  std::array<double, 3> position_m{};
  std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};  ///< unit quaternion, solid -> entity
  auto operator<=>(const SolidShape&) const = default;      // NOLINT(modernize-use-nullptr): its 0 is none
};

/// An entity that exists from the first tick on, at rest or with constant velocities. World frame,
/// right-handed, z up.
struct WorldEntity {
  Word name;
  Shape shape;        ///< NoShape: a light alone, which is no body
  Place shape_place;  ///< with a shape
  std::array<double, 3> position_m{};
  std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};  ///< unit quaternion, entity -> world
  std::array<double, 3> velocity_mps{};
  std::array<double, 3> angular_velocity_radps{};
  double scale = 1.0;
  Place scale_place;
  std::optional<DistanceField> field;
  std::optional<FileShape> convex_parts;  ///< each piece of the mesh is a convex part of the shape
  std::optional<SolidShape> solid;
  Place solid_place;             ///< with a solid
  std::optional<Word> material;  ///< of World::materials; none: the default material
  std::optional<Word> light;     ///< of World::lights
  std::vector<Word> mask;        ///< layer names, at least one
  std::uint32_t mask_bits = 0;   ///< the same by Layers

  bool is_body() const noexcept { return !std::holds_alternative<NoShape>(shape); }
};

/// A box in space, for inside(body, region) and crossed_at(body, region) of expressions.
struct WorldRegion {
  Word name;
  std::array<double, 3> center_m{};
  std::array<double, 3> size_m{};  ///< before the rotation
  double heading_rad = 0.0;        ///< about z
  bool whole = false;              ///< all of the body has to be in it, not a part
  std::optional<Word> carrier;     ///< the body in whose frame it is
};

/// A straight line from a point, for sees(beam, body) of expressions.
struct WorldBeam {
  Word name;
  std::array<double, 3> origin_m{};
  double azimuth_rad = 0.0, elevation_rad = 0.0, range_m = 0.0;
  std::optional<Word> carrier;  ///< the body in whose frame it is
};

/// Points, or light paths, of a pixel of a view, by default.
constexpr std::uint32_t default_view_samples(bool is_path_traced) noexcept {
  return is_path_traced ? 64 : 4;
}

/// A place from which the report shows the world at the end of the run, and `hil history DIR image` at any
/// time.
struct WorldView {
  Word name;
  std::optional<Word> carrier;  ///< the body in whose frame both points are
  std::array<double, 3> position_m{};
  std::array<double, 3> look_at_m{};
  std::uint32_t width = 0, height = 0;
  double field_of_view_rad = 0.0;  ///< horizontal
  bool is_path_traced = false;
  std::uint32_t samples = 0;
  std::uint32_t bounces = 0;
  std::optional<double> exposure_value;  ///< empty: by the brightness of the image
  std::vector<Word> layers;              ///< empty: all
};

/// The names of the 32 bits of a mask, in the order of their bits.
class Layers {
 public:
  static constexpr std::size_t capacity = 32;

  const std::vector<std::string>& names() const noexcept { return names_; }
  /// The one bit of the layer; empty when there is no such layer.
  std::optional<std::uint32_t> bit(std::string_view name) const noexcept;
  /// The same; a new name takes the next bit. Empty when all are taken.
  std::optional<std::uint32_t> add(std::string_view name);

 private:
  std::vector<std::string> names_;
};

struct World {
  std::string gpu;  ///< a device's name, its index, or "auto"
  std::uint32_t max_entities = 0;
  std::uint32_t max_geometries = 0;
  std::uint32_t retained_changes = 0;
  std::uint32_t queue_capacity = 0;
  std::int64_t chunk_ns = 0;  ///< 0: batches are not divided
  Durability durability = Durability::async;
  std::int64_t flush_interval_ns = 0;
  std::uint64_t log_ring_bytes = 0;
  Layers layers;  ///< those listed under `layers`; when none are, those of the entities in their order
  bool layers_are_listed = false;
  std::vector<WorldMaterial> materials;
  std::vector<WorldLight> lights;
  std::vector<WorldEntity> entities;
  std::vector<WorldRegion> regions;
  std::vector<WorldBeam> beams;
  std::vector<WorldView> views;
};

/// A value that is computed at the end of each tick from signals and other variables.
struct VariableSection {
  Word name;
  std::optional<Expression> expression;  ///< empty: it has a mistake, which is reported
  std::optional<Word> unit;              ///< empty: that of the expression
};

/// One input port of a module and the signal that feeds it.
struct InputLink {
  Word port;
  Word signal;
};

struct TaskSection {
  Word module;  ///< the instance's name
  Word type;
  double rate_hz = 0.0;
  std::uint32_t every_ticks = 1;
  std::uint32_t offset_ticks = 0;
  std::int64_t deadline_ns =
      0;  ///< at most the task's period; on a thread of its own a multiple of the base period
  std::int64_t budget_ns = 0;  ///< 0: none
  Overrun overrun = Overrun::skip;
  std::uint32_t warmup_runs = 0;
  std::string thread;              ///< empty: the base thread
  std::optional<Place> firm_at{};  ///< where the task asks for firm transactions; empty: they are soft
  Value parameters;                ///< as the module type's schema promises
  std::vector<InputLink> inputs;
};

/// A word of a command line: text with placeholders of buses in it, each known to exist, and {clock}: "wall"
/// in real time, "stepped" under the virtual clock.
struct CommandWord {
  Word written;
  struct Placeholder {
    std::size_t begin = 0;   ///< of the '{' in the text
    std::size_t length = 0;  ///< with both braces
    std::string section;     ///< the key of a bus type, or "clock"
    std::string name;        ///< of a bus
  };
  std::vector<Placeholder> placeholders;

  /// The word with each placeholder replaced by `address_of(section, name)`.
  template <typename AddressOf>
  std::string expand(const AddressOf& address_of) const {
    std::string text;
    std::size_t from = 0;
    for (const Placeholder& placeholder : placeholders) {
      text += written.text.substr(from, placeholder.begin - from) +
              address_of(placeholder.section, placeholder.name);
      from = placeholder.begin + placeholder.length;
    }
    return text + written.text.substr(from);
  }
};

/// A program that the run starts, watches and ends. The device under test is the one called "dut".
struct ProcessSection {
  Word name;
  bool enabled = true;
  std::vector<CommandWord> command;  ///< the program first; at least one word
  bool safe_on_exit = true;          ///< outputs go to their safe values when it ends before the run does
  bool may_be_lost = false;          ///< an end before the run's does not make the run fail
  bool free_running = false;         ///< under the virtual clock: it need not keep step with the run
  std::int64_t start_timeout_ns = 0;
};

/// What a run records in recording.mcap.
struct Recording {
  std::vector<Word> signals;  ///< names, and patterns with `*`
  bool frames = true;         ///< of the buses that have frames
  std::uint64_t max_bytes = 0;
};

/// A plot of signals in the report.
struct PlotSection {
  std::string title;
  std::vector<Word> signals;               ///< at least one, each once
  std::optional<std::int64_t> from_ns{};   ///< run time; empty: from the first tick
  std::optional<std::int64_t> until_ns{};  ///< after from_ns; empty: to the end of the run
};
/// The most entries of `plots`, and the most signals of one.
inline constexpr std::size_t max_plots = 20;
inline constexpr std::size_t max_plot_signals = 12;

struct Scenario {
  std::string file;  ///< absolute
  std::string name;
  std::string about;  ///< may be empty
  double base_rate_hz = 0.0;
  std::int64_t base_period_ns = 0;
  std::int64_t duration_ns = 0;
  std::uint64_t duration_ticks = 0;
  ClockKind clock = ClockKind::realtime;
  std::uint64_t seed = 0;
  bool writes_trace = true;
  Realtime realtime;
  World world;
  std::vector<VariableSection> variables;
  std::vector<StimulusSection> stimuli;
  std::vector<FaultSection> faults;
  std::vector<TaskSection> tasks;
  BusSections buses;                      ///< by type in the order of ScenarioTypes, then as in the file
  std::vector<ProcessSection> processes;  ///< dut first when there is one, then as in the file
  std::vector<Expectation> expectations;
  std::optional<Recording> recording;  ///< empty: none
  std::vector<PlotSection> plots;
};

/// Module types by their name in `type:`, each with the schema of its parameters.
using SchemaOfModules = std::map<std::string, Schema>;

/// The types that scenarios name and this folder does not know. A scenario refers to its bus types: they
/// outlive it.
struct ScenarioTypes {
  SchemaOfModules modules{};
  std::span<const BusSectionType> buses{};
  std::span<const ExpectationKind> expectations{};
  TableClaims table_claims{};
};

/// What a scenario file may contain, parameters of modules left open (Kind::any).
Schema scenario_schema(const ScenarioTypes& types);

/// Reads the scenario, its modules' parameters and the files of its buses, and checks all that can be checked
/// without opening a device: the schemas, that rates divide the base rate, that offsets, deadlines and
/// periods fit, that names are unique, and that names refer to something in the file. Reports all mistakes at
/// once and is empty when there was one. `overrides`: see overrides.hpp.
std::optional<Scenario> load_scenario(const std::string& path, std::span<const std::string> overrides,
                                      const ScenarioTypes& types, Diagnostics& diagnostics);

/// As load_scenario, for a scenario that is wired next: leaves out expectations, plots and expressions of
/// variables with mistakes, so that the user sees their mistakes and those of the wiring at once. Empty when
/// anything else is wrong. The scenario must not run unless `diagnostics` is empty.
std::optional<Scenario> load_scenario_to_wire(const std::string& path, std::span<const std::string> overrides,
                                              const ScenarioTypes& types, Diagnostics& diagnostics);

}  // namespace hil::config
