#pragma once
// report.json: the complete record of a run, for programs and for making the page again. There is no second,
// larger file: what the page shows is in here, histograms and pictures included. world.json beside it has the names
// that a history is asked with.
//
// Both end with a checksum, which their readers verify (file_checksum.hpp).
//
// Keys keep the order of record_fields.hpp. Numbers are finite; what is not known is null. Text is
// UTF-8, bytes that are not become U+FFFD. Bins, points and
// track points are rows: bin [first_ns, last_ns, count]; point [x, y]; track point [time_ns, x, y]; scan
// point [x, y, z, azimuth, elevation, range, entity], rounded to 0.1 mm and 1 microradian. Writing, reading
// and writing again gives the same bytes.

#include <stdexcept>
#include <string>
#include <string_view>

#include "runtime/report/run_record.hpp"
#include "runtime/report/world_record.hpp"

namespace hil::report {

/// What could not be read or written, with the file or the place in it and why.
class ReportError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

std::string report_json(const RunRecord& record);

/// Keys it does not know are passed over. Throws ReportError: not JSON (with the byte), another
/// schema_version, a checksum that is missing or wrong, a key missing or of the wrong type (with its path,
/// as in "tasks[3].wall_ns.p50").
RunRecord parse_report(std::string_view json);

/// The same for world.json.
std::string world_json(const WorldRecord& record);
WorldRecord parse_world(std::string_view json);

}  // namespace hil::report
