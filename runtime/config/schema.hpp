#pragma once
// What a configuration may contain, as data: each part of the program describes its own section with a
// Schema, and the one parser (parse.hpp) checks a file against it. A value that came through is complete
// (defaults filled in), in SI units and within its range, so nobody checks it again.

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/config/diagnostics.hpp"

namespace hil::config {

/// What a number measures. A quantity is written with its unit ("50 km/h", "10 ms", "140 deg") and a missing
/// or wrong unit is a mistake. Values are held in the SI unit named here.
enum class Quantity : std::uint8_t {
  length_m,
  speed_mps,
  acceleration_mps2,
  angle_rad,
  angular_rate_radps,
  duration_s,
  frequency_hz,
  mass_kg,
};

enum class Kind : std::uint8_t {
  text,
  boolean,
  integer,
  number,
  quantity,
  file,
  list,
  record,
  map,
  choice,
  any
};

struct Field;

/// A tree; cheap to copy.
class Schema {
 public:
  static Schema text();
  static Schema one_of(std::vector<std::string> words);  ///< text out of a closed list
  static Schema boolean();
  static Schema integer(std::int64_t minimum, std::int64_t maximum);
  static Schema number(double minimum, double maximum);  ///< dimensionless
  static Schema quantity(Quantity quantity, double minimum_si, double maximum_si);
  static Schema
  file();  ///< a path; relative ones start at the file that names them; must exist and be readable
  static Schema list(Schema item, std::size_t minimum_items = 0, std::size_t maximum_items = 1'000'000);
  static Schema record(std::vector<Field> fields);
  static Schema map(Schema item);  ///< keys are the user's names
  /// A record whose other fields depend on the word under `key` ("type: vehicles").
  static Schema choice(std::string key, std::vector<std::pair<std::string, Schema>> alternatives);
  /// A record of which exactly one field is present ({box: ...} or {file: ...}).
  static Schema exactly_one(std::vector<Field> fields);
  static Schema any();  ///< kept as it is, for a second parse with a schema known later

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
  std::string about;  ///< one sentence for the documentation and for error messages

  static Field needed(std::string name, Schema schema, std::string about);
  static Field with_default(std::string name, Schema schema, std::string default_yaml, std::string about);
  static Field optional(std::string name, Schema schema, std::string about);
};

/// A checked value and where it stands. Misuse (asking for a kind or a field that the schema does not
/// promise) asserts.
class Value {
 public:
  Kind kind() const noexcept;
  const Place& place() const noexcept;

  const std::string& text() const;  ///< text, one_of, and file (as an absolute path)
  bool boolean() const;
  std::int64_t integer() const;
  double number() const;                                    ///< number, and quantity in SI
  std::int64_t duration_ns() const;                         ///< a duration, rounded to the nearest nanosecond
  const std::vector<Value>& items() const;                  ///< list
  bool has(const std::string& field) const;                 ///< record, map, choice, exactly_one
  const Value& operator[](const std::string& field) const;  ///< the same; a choice also holds its key
  const std::vector<std::pair<std::string, Value>>& entries() const;  ///< fields in the order of the file
  const std::string& chosen() const;  ///< choice: the word under its key; exactly_one: the field present

  struct Data;
  explicit Value(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

 private:
  std::shared_ptr<const Data> data_;
};

}  // namespace hil::config
