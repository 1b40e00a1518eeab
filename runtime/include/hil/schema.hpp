#pragma once
// What a configuration may contain, as data. Each part of the program describes its own section with a
// Schema, and the parser (parse.hpp) checks a file against it. A checked value is complete (defaults filled
// in), in SI units and within its range.
//
// The schema alone decides what a scalar means: `name: no` is the text "no" where text is expected. Where a
// boolean is expected, only true and false are accepted (yes, no, on, off, True and quoted words are
// mistakes).
//
// Threads: schemas and values are immutable; share them freely. Building a schema with two fields of one name
// is misuse and asserts, and so is reading a value with one whose field refuses its own default.

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <hil/diagnostics.hpp>

namespace hil::config {

/// What a number measures. A quantity is written with its unit ("50 km/h", "10 ms", "140 deg") and a missing
/// or wrong unit is a mistake, for zero as well. Values are held in the SI unit named here.
enum class Quantity : std::uint8_t {
  length_m,
  speed_mps,
  acceleration_mps2,
  angle_rad,
  angular_rate_radps,
  duration_s,
  frequency_hz,
  mass_kg,
  force_n,
  torque_nm,
  inertia_kgm2,
  stiffness_npm,
  damping_nspm,
  illuminance_lx,
  luminous_intensity_cd,
  luminance_cdpm2,
  share,       ///< dimensionless, written in per cent: 95 % is 0.95
  data_bytes,  ///< a size of files or memory, which is no unit of signals
};

enum class Kind : std::uint8_t {
  text,
  boolean,
  integer,
  number,
  quantity,
  file,
  color,
  list,
  record,
  map,
  choice,
  any,
};

struct Field;

/// A tree; cheap to copy.
class Schema {
 public:
  static Schema text();    ///< not empty
  static Schema name();    ///< letters, digits and _, beginning with a letter or _
  static Schema signal();  ///< names joined by dots: "can.car.Brake.Force"; or a relation: "distance(a, b)"
  static Schema one_of(std::vector<std::string> words);  ///< text out of a closed list
  static Schema boolean();
  static Schema integer(std::int64_t minimum, std::int64_t maximum);  ///< decimal or 0x...
  static Schema number(double minimum, double maximum);               ///< dimensionless
  static Schema quantity(Quantity quantity, double minimum_si, double maximum_si);
  /// A path; must be a readable regular file. Relative ones start at the file that names them, and those of a
  /// --set option at the current directory.
  static Schema file();
  /// Three channels from 0 to `maximum`: "[r, g, b]", linear with the primaries of sRGB, or "'#rrggbb'",
  /// sRGB. The value is a list of three numbers, linear.
  static Schema color(double maximum);
  static Schema list(Schema item, std::size_t minimum_items = 0, std::size_t maximum_items = 1'000'000);
  static Schema record(std::vector<Field> fields);
  /// A record that may also be written as one scalar, which is then the value of `key`: "BrakeCommand" for
  /// {message: BrakeCommand}.
  static Schema record_or(std::string key, std::vector<Field> fields);
  /// Keys are names that the file defines, so --set adds none.
  static Schema map(Schema item);
  /// Keys are names that something else defines and checks, as the signals of a message: --set adds some.
  static Schema map_of_checked_names(Schema item);
  /// A record whose other fields depend on the word under `key` ("type: vehicles").
  static Schema choice(std::string key, std::vector<std::pair<std::string, Schema>> alternatives);
  /// A record of which exactly one field of `alternatives` is present ({box: ...} or {file: ...}), next to
  /// the `common` ones.
  static Schema exactly_one(std::vector<Field> alternatives);
  static Schema exactly_one(std::vector<Field> alternatives, std::vector<Field> common);
  static Schema any();  ///< kept as it is, for a second parse with a schema known later (parse_value)

  struct Node;
  const Node& node() const noexcept { return *node_; }

 private:
  explicit Schema(std::shared_ptr<const Node> node) : node_(std::move(node)) {}
  std::shared_ptr<const Node> node_;
};

struct Field {
  std::string name;
  Schema schema;
  /// As the user would write it; parsed like the user's own text. Empty and `required` false: the field stays
  /// absent.
  std::optional<std::string> default_yaml;
  bool required = false;
  std::string about;       ///< one sentence for the documentation and for error messages
  std::string old_name{};  ///< an earlier name, which is refused with `name`; empty: there is none

  static Field needed(std::string name, Schema schema, std::string about);
  static Field with_default(std::string name, Schema schema, std::string default_yaml, std::string about);
  static Field optional(std::string name, Schema schema, std::string about);
  /// This field, with its earlier name.
  Field renamed_from(std::string earlier_name) const;
};

/// A checked value and its place. The place of a field with its default is that of its record. Cheap to copy.
/// Misuse (asserts): a kind or a field that the schema does not promise.
class Value {
 public:
  Kind kind() const noexcept;
  const Place& place() const noexcept;

  const std::string& text() const;  ///< text, name, signal, one_of, and file (as an absolute path)
  /// Text: the place of the character at `index`.
  Place place_in_text(std::size_t index) const;
  bool boolean() const;
  std::int64_t integer() const;
  double number() const;                                  ///< number, and quantity in SI
  std::int64_t duration_ns() const;                       ///< a duration, rounded to the nearest nanosecond
  const std::vector<Value>& items() const;                ///< list
  bool has(std::string_view field) const;                 ///< record, map, choice, exactly_one
  const Value& operator[](std::string_view field) const;  ///< the same; a choice also holds its key
  /// The fields written, in the order of the file, then the defaults; of a map with the places of its keys in
  /// key_place.
  const std::vector<std::pair<std::string, Value>>& entries() const;
  /// Record, map: the place of the key of entries()[index]; for a default, the record's place.
  const Place& key_place(std::size_t index) const;
  const std::string& chosen()
      const;  ///< choice: the word under its key; exactly_one: the alternative present

  struct Data;
  explicit Value(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  const Data& data() const noexcept { return *data_; }

 private:
  std::shared_ptr<const Data> data_;
};

}  // namespace hil::config
