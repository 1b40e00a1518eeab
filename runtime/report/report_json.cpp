#include "runtime/report/report_json.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <type_traits>
#include <utility>
#include <variant>

#include "runtime/report/bus_json.hpp"
#include "runtime/report/file_checksum.hpp"
#include "runtime/report/json_cursor.hpp"
#include "runtime/report/json_layout.hpp"
#include "runtime/report/record_fields.hpp"
#include "runtime/report/text_safety.hpp"

namespace hil::report {
namespace {

using Json = nlohmann::ordered_json;

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {};

template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<std::optional<T>> : std::true_type {};

double rounded(double value, double per_unit) {
  const double result = std::round(value * per_unit) / per_unit;
  return result == 0.0 ? 0.0 : result;  // never "-0.0"
}
double rounded_length(double value_m) {
  return rounded(value_m, 1e4);
}
double rounded_angle(double value_rad) {
  return rounded(value_rad, 1e6);
}

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}
Json length(double value_m) {
  return number(rounded_length(value_m));
}
Json angle(double value_rad) {
  return number(rounded_angle(value_rad));
}

// ---- writing ----

template <class T>
Json written(const T& value);

Json row(const Bin& bin) {
  return Json::array({bin.first_ns, bin.last_ns, bin.count});
}
Json row(const PointM& point) {
  return Json::array({length(point.x_m), length(point.y_m)});
}
Json row(const TrackPoint& point) {
  return Json::array({point.time_ns, length(point.x_m), length(point.y_m)});
}
Json row(const SensorPoint& point) {
  return Json::array({length(point.x_m), length(point.y_m), length(point.z_m), angle(point.azimuth_rad),
                      angle(point.elevation_rad), length(point.range_m), point.entity});
}
Json row(const ActiveSpan& span) {
  return Json::array({span.begin_ns, span.end_ns});
}
Json row(const SignalPoint& point) {
  Json values = Json::array({point.bucket, number(point.min)});
  if (point.max > point.min) values.push_back(number(point.max));
  return values;
}
Json row(const std::array<double, 2>& pair) {
  return Json::array({number(pair[0]), number(pair[1])});
}

template <class T>
concept Row = requires(const T& value) {
  row(value);
};

template <class T>
Json written(const T& value) {
  if constexpr (Row<T>) {
    return row(value);
  } else if constexpr (std::same_as<T, double>) {
    return number(value);
  } else if constexpr (std::is_enum_v<T>) {
    return to_string(value);
  } else if constexpr (std::same_as<T, std::string>) {
    return valid_utf8(value);
  } else if constexpr (std::is_arithmetic_v<T>) {
    return value;
  } else if constexpr (IsOptional<T>::value) {
    return value ? written(*value) : Json(nullptr);
  } else if constexpr (IsVector<T>::value) {
    Json list = Json::array();
    for (const auto& item : value)
      list.push_back(written(item));
    return list;
  } else {
    Json object = Json::object();
    each_field(value, [&](const char* key, const auto& member) { object[key] = written(member); });
    return object;
  }
}

// ---- reading ----

template <class T>
void read(const JsonCursor& cursor, T& value);

template <class... Items>
void read_items(const JsonCursor& cursor, Items&... items) {
  if (!cursor.json.is_array() || cursor.json.size() != sizeof...(items)) {
    cursor.refuse("a list of " + std::to_string(sizeof...(items)));
  }
  std::size_t index = 0;
  (read(cursor.item(index++), items), ...);
}

void read_row(const JsonCursor& cursor, Bin& bin) {
  read_items(cursor, bin.first_ns, bin.last_ns, bin.count);
}
void read_row(const JsonCursor& cursor, PointM& point) {
  read_items(cursor, point.x_m, point.y_m);
}
void read_row(const JsonCursor& cursor, TrackPoint& point) {
  read_items(cursor, point.time_ns, point.x_m, point.y_m);
}
void read_row(const JsonCursor& cursor, SensorPoint& point) {
  read_items(cursor, point.x_m, point.y_m, point.z_m, point.azimuth_rad, point.elevation_rad, point.range_m,
             point.entity);
}
void read_row(const JsonCursor& cursor, ActiveSpan& span) {
  read_items(cursor, span.begin_ns, span.end_ns);
}
void read_row(const JsonCursor& cursor, SignalPoint& point) {
  if (cursor.json.is_array() && cursor.json.size() == 3) {
    read_items(cursor, point.bucket, point.min, point.max);
  } else {
    read_items(cursor, point.bucket, point.min);
    point.max = point.min;
  }
}
void read_row(const JsonCursor& cursor, std::array<double, 2>& pair) {
  read_items(cursor, pair[0], pair[1]);
}

void read_word(const JsonCursor& cursor, Verdict& verdict) {
  const auto found = cursor.json.is_string() ? verdict_from(cursor.json.get<std::string>()) : std::nullopt;
  if (!found) cursor.refuse("a verdict");
  verdict = *found;
}
void read_word(const JsonCursor& cursor, ExpectationResult& result) {
  const auto found =
      cursor.json.is_string() ? expectation_result_from(cursor.json.get<std::string>()) : std::nullopt;
  if (!found) cursor.refuse("the result of an expectation");
  result = *found;
}
void read_word(const JsonCursor& cursor, SeriesKind& kind) {
  const auto found =
      cursor.json.is_string() ? series_kind_from(cursor.json.get<std::string>()) : std::nullopt;
  if (!found) cursor.refuse("the kind of a series");
  kind = *found;
}
void read_word(const JsonCursor& cursor, contribution::Mark& mark) {
  const auto found =
      cursor.json.is_string() ? contribution::mark_from(cursor.json.get<std::string>()) : std::nullopt;
  if (!found) cursor.refuse("a mark");
  mark = *found;
}
void read_word(const JsonCursor& cursor, Layer& layer) {
  const auto found = cursor.json.is_string() ? layer_from(cursor.json.get<std::string>()) : std::nullopt;
  if (!found) cursor.refuse("a layer");
  layer = *found;
}

template <class T>
void read_integer(const JsonCursor& cursor, T& value) {
  if (!cursor.json.is_number_integer()) cursor.refuse("an integer");
  if (cursor.json.is_number_unsigned()) {
    const auto wide = cursor.json.get<std::uint64_t>();
    if (!std::in_range<T>(wide)) cursor.refuse("an integer that fits");
    value = static_cast<T>(wide);
  } else {
    const auto wide = cursor.json.get<std::int64_t>();
    if (!std::in_range<T>(wide)) cursor.refuse("an integer that fits");
    value = static_cast<T>(wide);
  }
}

template <class T>
void read(const JsonCursor& cursor, T& value) {
  if constexpr (Row<T>) {
    read_row(cursor, value);
  } else if constexpr (std::same_as<T, double>) {
    if (!cursor.json.is_number() && !cursor.json.is_null()) cursor.refuse("a number");
    value = cursor.json.is_null() ? not_known : cursor.json.get<double>();
  } else if constexpr (std::is_enum_v<T>) {
    read_word(cursor, value);
  } else if constexpr (std::same_as<T, bool>) {
    if (!cursor.json.is_boolean()) cursor.refuse("true or false");
    value = cursor.json.get<bool>();
  } else if constexpr (std::is_integral_v<T>) {
    read_integer(cursor, value);
  } else if constexpr (std::same_as<T, std::string>) {
    if (!cursor.json.is_string()) cursor.refuse("text");
    value = cursor.json.get<std::string>();
  } else if constexpr (IsOptional<T>::value) {
    if (!cursor.json.is_null()) read(cursor, value.emplace());
  } else if constexpr (IsVector<T>::value) {
    if (!cursor.json.is_array()) cursor.refuse("a list");
    value.resize(cursor.json.size());
    for (std::size_t index = 0; index < value.size(); ++index)
      read(cursor.item(index), value[index]);
  } else {
    each_field(value, [&](const char* key, auto& value_of_key) { read(cursor.member(key), value_of_key); });
  }
}

// ---- the records of modules: lists of world.json, and those under the key `lists` of report.json ----

/// Adds each record to the list that it names.
void add_module_records(const std::vector<contribution::ModuleRecord>& records, Json& lists) {
  for (const contribution::ModuleRecord& module : records) {
    Json object = Json::object();
    object["name"] = written(module.name);
    for (const contribution::Property& property : module.properties)
      object[property.key] = std::visit([](const auto& value) { return written(value); }, property.value);
    lists[module.list].push_back(std::move(object));
  }
}

contribution::Property property_at(const JsonCursor& cursor, const std::string& key) {
  contribution::Property property{.key = key, .value = {}};
  if (cursor.json.is_boolean()) {
    read(cursor, property.value.emplace<bool>());
  } else if (cursor.json.is_number_integer()) {
    read(cursor, property.value.emplace<std::int64_t>());
  } else if (cursor.json.is_number() || cursor.json.is_null()) {
    read(cursor, property.value.emplace<double>());
  } else if (cursor.json.is_array()) {
    read(cursor, property.value.emplace<std::vector<double>>());
  } else if (cursor.json.is_string()) {
    read(cursor, property.value.emplace<std::string>());
  } else {
    cursor.refuse("a number, a text, true, false or a list of numbers");
  }
  return property;
}

/// Every list beside those of the world itself holds records of modules.
void read_module_records(const JsonCursor& lists, std::vector<contribution::ModuleRecord>& records) {
  if (!lists.json.is_object()) lists.refuse("an object");
  for (const auto& [list_key, list] : lists.json.items()) {
    if (!list.is_array() || list_key == "layers" || list_key == "entities" || list_key == "fields" ||
        list_key == "plugins")
      continue;
    const JsonCursor cursor = lists.member(list_key.c_str());
    for (std::size_t index = 0; index < list.size(); ++index) {
      const JsonCursor item = cursor.item(index);
      contribution::ModuleRecord module{.list = list_key, .name = {}, .properties = {}};
      read(item.member("name"), module.name);
      for (const auto& [key, value] : item.json.items()) {
        if (key != "name") module.properties.push_back(property_at(item.member(key.c_str()), key));
      }
      records.push_back(std::move(module));
    }
  }
}

// ---- whole files ----

template <class Record>
std::string file_of(const Record& record, int version) {
  Json json = Json::object();
  json["schema_version"] = version;
  each_field(record, [&](const char* key, const auto& member) {
    json[key] = written(member);
    if constexpr (std::same_as<decltype(member), const std::vector<BusGroup>&>) add_bus_lists(member, json);
  });
  if constexpr (std::same_as<Record, WorldRecord>) add_module_records(record.modules, json);
  if constexpr (std::same_as<Record, RunRecord>)
    add_module_records(record.lists, json["lists"] = Json::object());
  return with_checksum(readable_json(json));
}

template <class Record>
Record parsed(const std::string& file, std::string_view text, int wanted) {
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::parse_error& error) {
    throw ReportError(file + ": not JSON at byte " + std::to_string(error.byte) +
                      ": it was cut off or damaged; take an unchanged copy, or run the scenario again");
  } catch (const Json::out_of_range& error) {
    throw ReportError(file + ": a number is out of range: " + error.what());
  }
  const JsonCursor whole{file, json, ""};
  int version = 0;
  read(whole.member("schema_version"), version);
  if (version != wanted) {
    throw ReportError(file + ": schema_version is " + std::to_string(version) + "; this program reads " +
                      std::to_string(wanted));
  }
  if (const std::string fault = checksum_fault(text); !fault.empty()) throw ReportError(file + ": " + fault);
  Record record;
  read(whole, record);
  if constexpr (std::same_as<Record, WorldRecord>) read_module_records(whole, record.modules);
  if constexpr (std::same_as<Record, RunRecord>) {
    read_bus_lists(whole, record.buses);
    read_module_records(whole.member("lists"), record.lists);
  }
  return record;
}

}  // namespace

std::string report_json(const RunRecord& record) {
  return file_of(record, schema_version);
}

RunRecord parse_report(std::string_view text) {
  return parsed<RunRecord>("report.json", text, schema_version);
}

std::string world_json(const WorldRecord& record) {
  return file_of(record, world_schema_version);
}

WorldRecord parse_world(std::string_view text) {
  return parsed<WorldRecord>("world.json", text, world_schema_version);
}

}  // namespace hil::report
