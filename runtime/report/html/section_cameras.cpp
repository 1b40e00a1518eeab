#include <algorithm>
#include <string>

#include "runtime/report/html/sections.hpp"
#include "runtime/report/html/table.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

std::string caption_of(const Camera& camera) {
  std::string text = "Exposure value " + shortest(camera.exposure_value);
  if (camera.last_tick)
    text = "Tick " + count_text(*camera.last_tick) + ", " + instant(camera.last_time_ns.value_or(0)) + ". " +
           text;
  return text + ", " + camera.last_file + ".";
}

void draw_last_image(Markup& out, const Camera& camera) {
  out.open("figure").element("h3", camera.name);
  out.leaf("img", {{"alt", "the last image of camera " + camera.name},
                   {"src", "data:image/png;base64," + camera.last_image_png}});
  out.element("figcaption", caption_of(camera)).close();
}

}  // namespace

void cameras_section(Markup& out, const RunRecord& record) {
  if (record.cameras.empty()) return;
  out.element("h2", "Cameras");
  out.open("div", {{"class", "card"}});
  if (std::ranges::any_of(record.cameras, [](const Camera& one) { return !one.last_image_png.empty(); })) {
    out.open("div", {{"class", "panels"}});
    for (const Camera& camera : record.cameras)
      if (!camera.last_image_png.empty()) draw_last_image(out, camera);
    out.close();
  }
  Table table(out, {{"Camera"},
                    {"Images", true},
                    {"Dropped", true},
                    {"Beyond max_size", true},
                    {"Missing tiles", true},
                    {"Last file"}});
  for (const Camera& camera : record.cameras)
    table.row({camera.name, count_text(camera.images), count_cell(camera.dropped, true),
               count_text(camera.beyond_limit), count_cell(camera.missing_tiles, true),
               camera.last_file.empty() ? std::string(dash) : camera.last_file});
  table.end();
  out.close();
}

}  // namespace hil::report
