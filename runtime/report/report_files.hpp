#pragma once
// The files of a run that are functions of its records: report.json, report.html, junit.xml, the pictures
// as SVG files, trace.json and world.json.
//
// Each file is written under a temporary name and renamed when it is complete, so that a reader never sees
// a part of a file, and no part stays when the disk fails. All functions throw ReportError with the path
// and the system's error.

#include <filesystem>

#include "runtime/report/report_json.hpp"
#include "runtime/report/trace_json.hpp"

namespace hil::report {

/// report.json, then what remake_report writes. Makes the folder when it is missing.
void write_report(const RunRecord& record, const std::filesystem::path& directory);

/// junit.xml, report.html, pictures/top-view.svg (when the record has one) and pictures/<section>-<n>.svg
/// (n from 1): all that can be made again from report.json.
void remake_report(const RunRecord& record, const std::filesystem::path& directory);

/// junit.xml alone, of a run that was refused before its scenario was known (refusal_junit_xml).
void write_refusal_junit(const std::string& scenario, const std::string& mistakes,
                         const std::filesystem::path& directory);

void write_trace(const TraceRecord& trace, const std::filesystem::path& directory);

/// Reads DIR/report.json.
RunRecord load_report(const std::filesystem::path& directory);

/// DIR/world.json.
void write_world(const WorldRecord& record, const std::filesystem::path& directory);
WorldRecord load_world(const std::filesystem::path& directory);

}  // namespace hil::report
