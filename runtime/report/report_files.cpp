#include "runtime/report/report_files.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>

#include "runtime/report/html/plot.hpp"
#include "runtime/report/html/point_picture.hpp"
#include "runtime/report/html/report_html.hpp"
#include "runtime/report/html/signal_plot.hpp"
#include "runtime/report/html/top_view.hpp"
#include "runtime/report/html/world_window.hpp"
#include "runtime/report/junit_xml.hpp"
#include "runtime/report/markup.hpp"

namespace hil::report {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& path, const char* action, const std::string& error) {
  throw ReportError(path.string() + " can not be " + action + ": " + error);
}

std::string last_system_error() {
  return errno != 0 ? std::strerror(errno) : "the system gave no reason";
}

void make_directory(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) refuse(directory, "created", error.message());
}

void write_file(const fs::path& path, const std::function<void(std::ostream&)>& content) {
  const fs::path unfinished = path.string() + ".part";
  errno = 0;
  std::ofstream out(unfinished, std::ios::binary | std::ios::trunc);
  if (out) content(out);
  out.close();
  std::error_code error;
  std::string answer;
  if (!out) {
    answer = last_system_error();
  } else if (fs::rename(unfinished, path, error); error) {
    answer = error.message();
  }
  if (answer.empty()) return;
  fs::remove(unfinished, error);  // it may fill the disk
  refuse(path, "written", answer);
}

void write_text(const fs::path& path, const std::string& text) {
  write_file(path,
             [&](std::ostream& out) { out.write(text.data(), static_cast<std::streamsize>(text.size())); });
}

/// "scan-2.svg". A name from a changed report.json never leads out of the folder.
std::string picture_file(std::string name, int number) {
  for (char& letter : name) {
    if (std::isalnum(static_cast<unsigned char>(letter)) == 0) letter = '_';
  }
  return name + '-' + std::to_string(number) + ".svg";
}

void write_pictures(const RunRecord& record, const fs::path& directory) {
  const bool has_top_view = record.top_view && has_content(*record.top_view);
  const bool has_pictures = std::ranges::any_of(record.sections, [](const Section& section) {
    return !section.pictures.empty() || !section.plots.empty();
  });
  if (!has_top_view && !has_pictures && record.signal_plots.plots.empty()) return;
  make_directory(directory);
  if (has_top_view) {
    Markup svg;
    draw_top_view(svg, *record.top_view, PictureUse::standalone_file);
    write_text(directory / "top-view.svg", svg.take());
  }
  int signal_plots = 0;
  for (const SignalPlot& plot : record.signal_plots.plots) {
    Markup svg;
    draw_signal_plot(svg, record, plot, PictureUse::standalone_file);
    write_text(directory / picture_file("signals", ++signal_plots), svg.take());
  }
  std::map<std::string, int> written;  // by the section's name, so that sections of one name do not collide
  for (const Section& section : record.sections) {
    const PictureFrame frame = common_frame(section.pictures);
    for (const Picture& picture : section.pictures) {
      Markup svg;
      draw_point_picture(svg, picture, frame, PictureUse::standalone_file);
      write_text(directory / picture_file(section.name, ++written[section.name]), svg.take());
    }
    for (const contribution::Plot& plot : section.plots) {
      Markup svg;
      draw_plot(svg, plot, PictureUse::standalone_file);
      write_text(directory / picture_file(section.name, ++written[section.name]), svg.take());
    }
  }
}

template <class Record>
Record load(const fs::path& directory, const char* name, Record (*parse)(std::string_view)) {
  const fs::path path = directory / name;
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) refuse(path, "read", "it is no file");
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in.is_open() || in.bad()) refuse(path, "read", last_system_error());
  try {
    return parse(text);
  } catch (const ReportError& error) {
    throw ReportError((directory / "").string() + error.what());  // it begins with the file's name
  }
}

}  // namespace

void write_report(const RunRecord& record, const fs::path& directory) {
  make_directory(directory);
  const std::string json = report_json(record);
  write_text(directory / "report.json", json);
  // From the content of the file, which is rounded: `hil report` has to make the same pages, byte for byte.
  remake_report(parse_report(json), directory);
}

void remake_report(const RunRecord& record, const fs::path& directory) {
  make_directory(directory);
  write_text(directory / "junit.xml", junit_xml(record));
  write_pictures(record, directory / "pictures");
  write_text(directory / "report.html", report_html(record));
}

void write_refusal_junit(const std::string& scenario, const std::string& mistakes,
                         const fs::path& directory) {
  make_directory(directory);
  write_text(directory / "junit.xml", refusal_junit_xml(scenario, mistakes));
}

void write_trace(const TraceRecord& trace, const fs::path& directory) {
  make_directory(directory);
  write_file(directory / "trace.json", [&](std::ostream& out) { write_trace_json(out, trace); });
}

RunRecord load_report(const fs::path& directory) {
  return load(directory, "report.json", parse_report);
}

void write_world(const WorldRecord& record, const fs::path& directory) {
  write_text(directory / "world.json", world_json(record));
}

WorldRecord load_world(const fs::path& directory) {
  return load(directory, "world.json", parse_world);
}

}  // namespace hil::report
