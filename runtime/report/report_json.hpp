#pragma once
// report.json: the complete record of a run, for programs and for `hil report`, which makes the page from
// it alone: histograms and the points of pictures included. world.json beside it holds the names that `hil
// history` uses.
//
// Both end with a checksum, which their readers verify (file_checksum.hpp).
//
// Keys have the order of record_fields.hpp; a record of a module in world.json has its properties in the
// order of the module. Numbers are finite; null stands for a number that is not known. Text is UTF-8; bytes
// that are not UTF-8 become U+FFFD. Bins and points are rows: bin [first_ns, last_ns, count]; point [x, y];
// span [begin_ns, end_ns]; point of a signal [bucket, value] or [bucket, min, max];
// track point [time_ns, x, y]; sensor point [x, y, z, azimuth, elevation, range, entity], rounded to 0.1 mm
// and 1 microradian. Writing, reading and writing again gives the same bytes.

#include <stdexcept>
#include <string>
#include <string_view>

#include "runtime/contribution/world_record.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

using contribution::WorldRecord;

/// Written into world.json. A file with another number is refused.
inline constexpr int world_schema_version = 4;

/// What could not be read or written, with the file or the place in it and why.
class ReportError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

std::string report_json(const RunRecord& record);

/// Ignores keys that it does not know. Throws ReportError: not JSON (with the byte), another
/// schema_version, a checksum that is missing or wrong, a key missing or of the wrong type (with its path,
/// as in "tasks[3].wall_ns.p50").
RunRecord parse_report(std::string_view json);

/// The same for world.json.
std::string world_json(const WorldRecord& record);
WorldRecord parse_world(std::string_view json);

}  // namespace hil::report
