#include "runtime/report/html/report_html.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "hostile_text.hpp"
#include "runtime/report/html/page_style.hpp"
#include "runtime/report/html/plot_script.hpp"
#include "runtime/report/record_fields.hpp"
#include "runtime/report/text_safety.hpp"
#include "sample_record.hpp"
#include "strict_xml.hpp"

namespace hil::report {
namespace {

using test::parse_strictly;
using test::XmlElement;

/// Replaces every text of a record by `text`.
struct FillText {
  std::string text;
  void operator()(const char*, std::string& member) const { member = text; }
  template <class T>
  void operator()(const char*, std::vector<T>& members) const {
    for (T& member : members)
      (*this)("", member);
  }
  template <class T>
  void operator()(const char*, std::optional<T>& member) const {
    if (member) (*this)("", *member);
  }
  template <class T>
  void operator()(const char*, T& member) const {
    if constexpr (requires { each_field(member, *this); }) each_field(member, *this);
  }
};

/// The page has only elements and attributes that load nothing, and executes only its own script.
void expect_self_contained(const std::string& html) {
  static const std::set<std::string> elements{
      "html",  "head",  "meta",  "title", "style",    "body",   "main",   "header",     "section", "div",
      "span",  "h1",    "h2",    "h3",    "p",        "ul",     "li",     "dl",         "dt",      "dd",
      "table", "thead", "tbody", "tr",    "th",       "td",     "figure", "figcaption", "svg",     "g",
      "path",  "rect",  "line",  "text",  "clipPath", "script", "img"};
  static const std::set<std::string> attributes{
      "lang",        "charset",     "name",       "content",
      "class",       "id",          "scope",      "colspan",
      "rowspan",     "viewBox",     "role",       "aria-label",
      "aria-hidden", "style",       "d",          "x",
      "y",           "x1",          "y1",         "x2",
      "y2",          "width",       "height",     "text-anchor",
      "clip-path",   "data-label",  "dx",         "preserveAspectRatio",
      "data-begin",  "data-column", "data-width", "data-height",
      "data-y",      "data-low",    "data-high",  "data-steps",
      "data-names",  "alt",         "src"};
  std::set<std::string> ids;
  const XmlElement page = parse_strictly(html);
  for (const XmlElement* element : page.all()) {
    EXPECT_TRUE(elements.contains(element->name)) << element->name;
    for (const auto& [name, value] : element->attributes) {
      EXPECT_TRUE(attributes.contains(name)) << name;
      EXPECT_TRUE(name != "id" || ids.insert(value).second) << value << " twice";
      EXPECT_TRUE(name != "src" || value.starts_with("data:image/png;base64,")) << value;
      EXPECT_TRUE(name != "style" || value == "stroke-width:8") << value;
      EXPECT_TRUE(name != "clip-path" || value == "url(#top-view-area)" ||
                  value == "url(#top-view-area-phone)")
          << value;
    }
  }
  for (const XmlElement* script : page.all("script"))
    EXPECT_TRUE(script->text.ends_with(plot_script()) && script->text.size() <= plot_script().size() + 1);
  for (const char* outside : {"fetch", "XMLHttp", "import", "eval", ".src", "href", "innerHTML", "WebSocket"})
    EXPECT_EQ(plot_script().find(outside), std::string_view::npos) << outside;
  for (const XmlElement* style : page.all("style")) {
    for (const char* outside : {"url(", "@import", "@font-face", "image(", "expression"}) {
      EXPECT_EQ(style->text.find(outside), std::string::npos) << outside;
    }
  }
}

/// A browser reads other self-closed elements as opening tags.
void expect_html_reads_it_alike(const std::string& html) {
  static const std::set<std::string> may_be_empty{"meta", "br", "img", "line", "path", "rect"};
  for (std::size_t at = html.find("/>"); at != std::string::npos; at = html.find("/>", at + 1)) {
    const std::size_t start = html.rfind('<', at);
    const std::string name = html.substr(start + 1, html.find_first_of(" /", start) - start - 1);
    EXPECT_TRUE(may_be_empty.contains(name)) << name;
  }
}

TEST(ReportHtml, IsWellFormedAndSelfContained) {
  for (const RunRecord& record : {RunRecord{}, test::full_record()}) {
    const std::string html = report_html(record);
    expect_self_contained(html);
    expect_html_reads_it_alike(html);
    EXPECT_TRUE(html.starts_with("<!DOCTYPE html>"));
  }
}

TEST(ReportHtml, ShowsTheContentOfTheRecord) {
  const std::string text = parse_strictly(report_html(test::full_record())).whole_text();
  for (const char* expected :
       {"Failed",
        "1 of 2 expectations did not hold: no collision.",
        "collision.ego was 1",
        "8.412 s",
        "SCHED_FIFO at priority 60 was refused",
        "late wake-up",
        "3\u202F117",
        "402 µs",
        "virtual",
        "12.4 %",
        "hil-crossing-plc --listen 127.0.0.1:40213",
        "plc: 1 request was refused with exception 2 (illegal data address): reading level (holding 10).",
        "panel: 10 connections were refused: max_clients was reached",
        "was ended by signal 11 (Segmentation fault)",
        "car_1 runs its red light",
        "no tick for 20 ms; outputs set to their safe values",
        "Ticks were skipped 3 more times",
        "events of modules, stimuli and faults are listed, and 1\u202F049 more are not.",
        "4 of these in the warm-up",
        "dut.enabled=false",
        "Motion ignored",
        "With the scan",
        "Against the scan",
        "limit 50.0 ms",
        "car: 5 output values were beyond the range",
        "car: 7 output values were not a number",
        "car: 11 sets of outputs were not sent",
        "car: 13 frames are missing in the log",
        "car: 1 frame could not be sent",
        "car: 3 received frames were rejected",
        "car: 17 received frames are missing",
        "car: 19 sent frames were dropped by fault injection",
        "car: 23 frames of other stations were dropped by fault injection",
        "car: 29 frames were corrupted by fault injection",
        "car: 1031 frames were delayed by fault injection",
        "Tick 9900, 9.900 s.",
        "Exposure value 13.5, in daylight, since it sees no light of the world, without some lights",
        "since the world has too many, 3 pixels lack light, images/view-corner.png.",
        "y north"}) {
    EXPECT_NE(text.find(expected), std::string::npos) << expected;
  }
}

TEST(ReportHtml, ShowsViewsAndTheImagesOfSections) {
  const RunRecord record = test::full_record();
  const XmlElement page = parse_strictly(report_html(record));
  const auto images = page.all("img");
  ASSERT_EQ(images.size(), 2U);
  EXPECT_EQ(images[0]->attributes.at("alt"), "the world, seen from corner");
  EXPECT_EQ(images[0]->attributes.at("src"), "data:image/png;base64," + record.views[0].image_png);
  EXPECT_EQ(images[1]->attributes.at("src"), "data:image/png;base64," + record.sections[0].images[0].png);
  EXPECT_EQ(images[1]->attributes.at("alt"), "front");
}

TEST(ReportHtml, HasARowAndHistogramsForEachTask) {
  const RunRecord record = test::full_record();
  const XmlElement page = parse_strictly(report_html(record));
  for (const Task& task : record.tasks) {
    const auto cells = page.all("td");
    EXPECT_TRUE(std::ranges::any_of(cells, [&](const XmlElement* cell) { return cell->text == task.name; }))
        << task.name;
    const auto titles = page.all("h3");
    EXPECT_TRUE(std::ranges::any_of(titles, [&](const XmlElement* title) {
      return title->text == task.name;
    })) << task.name;
  }
  const auto pictures = page.all("svg");
  EXPECT_EQ(std::ranges::count_if(pictures,
                                  [](const XmlElement* svg) {
                                    const auto label = svg->attributes.find("aria-label");
                                    return label != svg->attributes.end() &&
                                           label->second.starts_with("Histogram of w");
                                  }),
            6);
}

TEST(ReportHtml, RowsHaveACellForEachColumn) {
  const XmlElement page = parse_strictly(report_html(test::full_record()));
  for (const XmlElement* table : page.all("table")) {
    std::size_t columns = 0;
    for (const XmlElement* head : table->all("th")) {
      if (!head->attributes.contains("colspan")) ++columns;
    }
    for (const XmlElement* row : table->all("tr")) {
      const std::size_t cells = row->all("td").size();
      EXPECT_TRUE(cells == 0 || cells == columns) << row->whole_text();
    }
  }
}

TEST(ReportHtml, EscapesHostileTextEverywhere) {
  RunRecord record = test::full_record();
  record.sections.at(0).pictures.resize(1);
  for (const std::string& text : test::hostile_texts()) {
    each_field(record, FillText{text});
    ASSERT_EQ(record.tasks.at(0).misses.at(0).cause, text) << "nested records are filled";
    ASSERT_EQ(record.top_view->shapes.at(0).label, text);
    const std::string html = report_html(record);
    expect_self_contained(html);
    EXPECT_EQ(clean_text(html), html);
    EXPECT_EQ(parse_strictly(html).all("title").front()->text, "Failed: " + clean_text(text));
  }
}

TEST(ReportHtml, VerdictHasItsColour) {
  for (const auto& [verdict, tone] : {std::pair{Verdict::passed, "verdict good"},
                                      {Verdict::failed, "verdict bad"},
                                      {Verdict::interrupted, "verdict warn"},
                                      {Verdict::timing_broken, "verdict bad"},
                                      {Verdict::io_failed, "verdict bad"},
                                      {Verdict::gpu_failed, "verdict bad"},
                                      {Verdict::refused, "verdict bad"}}) {
    RunRecord record;
    record.verdict = verdict;
    EXPECT_EQ(parse_strictly(report_html(record)).all("header").front()->attributes.at("class"), tone);
  }
}

TEST(ReportHtml, InterruptedRunShowsItsProgress) {
  RunRecord record;
  record.verdict = Verdict::interrupted;
  record.ticks = 2'400;  // and 100 skipped: the run still covers 2.5 s
  record.skipped_ticks = 100;
  record.run_time_ns = 2'500'000'000;
  record.wall_ns = 2'500'000'000;
  record.clock = "realtime";
  record.period_ns = 1'000'000;
  record.duration_ns = 10'000'000'000;
  EXPECT_NE(report_html(record).find("2.5 s of 10 s, 2\u202F400 ticks"), std::string::npos);
  EXPECT_NE(report_html(record).find("(1.00×)"), std::string::npos);
  EXPECT_NE(report_html(record).find("100 of 2\u202F500 ticks skipped (4.0 %)"), std::string::npos);
}

TEST(ReportHtml, MissesThatAreNotListedAreCounted) {
  RunRecord record;
  Task task;
  task.name = "late";
  task.deadline_misses = 5'000;
  for (std::uint64_t tick = 0; tick < 1'000; ++tick)
    task.misses.push_back({tick, "own work", 1'000});
  task.misses_by_cause = {{"own work", 5'000}};
  record.tasks = {task};
  const std::string text = parse_strictly(report_html(record)).whole_text();
  EXPECT_NE(text.find("5\u202F000 misses. By cause: own work 5\u202F000. The recorder kept the details of "
                      "1\u202F000 of them. "
                      "The first 200 are listed here; report.json has those."),
            std::string::npos);
}

/// The rules of a style sheet without its @media blocks, as (selectors, declarations).
std::vector<std::pair<std::string, std::string>> rules_of(std::string css) {
  for (std::size_t media = css.find("@media"); media != std::string::npos; media = css.find("@media")) {
    std::size_t end = css.find('{', media) + 1;
    for (int depth = 1; depth > 0; ++end)
      depth += css.at(end) == '{' ? 1 : css.at(end) == '}' ? -1 : 0;
    css.erase(media, end - media);
  }
  std::vector<std::pair<std::string, std::string>> rules;
  for (std::size_t at = 0; css.find('{', at) != std::string::npos;) {
    const std::size_t open = css.find('{', at);
    const std::size_t close = css.find('}', open);
    rules.emplace_back(css.substr(at, open - at), css.substr(open + 1, close - open - 1));
    at = close + 1;
  }
  return rules;
}

std::string phone_block() {
  const std::string css(page_style());
  const std::size_t begin = css.find("@media (max-width:640px){");
  return css.substr(begin, css.find("\n}\n", begin) - begin);
}

TEST(ReportHtml, ColumnsAreAsWideAsTheirWords) {
  // `anywhere` makes a single letter the least width of a column; `break-word` makes it the longest word.
  for (const auto& [selectors, declarations] : rules_of(std::string(page_style()))) {
    const bool of_cells =
        selectors.find("td") != std::string::npos || selectors.find(".name") != std::string::npos;
    if (of_cells) {
      EXPECT_EQ(declarations.find("overflow-wrap:anywhere"), std::string::npos) << selectors;
    }
  }
  EXPECT_NE(page_style().find("td{overflow-wrap:break-word}"), std::string_view::npos);
  const XmlElement page = parse_strictly(report_html(test::full_record()));
  for (const XmlElement* scroll : page.all("div")) {
    const auto css = scroll->attributes.find("class");
    if (css == scroll->attributes.end() || css->second != "scroll") continue;
    EXPECT_EQ(scroll->all("table").size(), 1U);
  }
}

TEST(ReportHtml, CellsOnAPhoneHaveALineWithTheirTitle) {
  const XmlElement page = parse_strictly(report_html(test::full_record()));
  ASSERT_FALSE(page.all("td").empty());
  for (const XmlElement* cell : page.all("td")) {
    ASSERT_TRUE(cell->attributes.contains("data-label")) << cell->whole_text();
    EXPECT_NE(cell->attributes.at("data-label"), "") << cell->whole_text();
  }
  const std::string phone = phone_block();
  EXPECT_NE(phone.find("td::before{content:attr(data-label)"), std::string::npos);
  EXPECT_NE(phone.find("table,tbody,tr{display:block}"), std::string::npos);
  // Rules for the width of cells on a wide page are reset.
  const std::size_t end = phone.find("{display:grid");
  const std::string reset =
      "," + phone.substr(phone.rfind('\n', end) + 1, end - phone.rfind('\n', end) - 1) + ",";
  for (const auto& [selectors, declarations] : rules_of(std::string(page_style()))) {
    std::string selector = selectors;
    std::erase(selector, '\n');
    const bool of_cells = selector == "td" || selector == ".key" || selector == ".name" ||
                          selector == ".nowrap" || selector == ".bar-cell" || selector == ".first" ||
                          selector.starts_with(".n:") || selector.starts_with(".n+") || selector == ".n";
    if (of_cells) {
      EXPECT_NE(reset.find("," + selector + ","), std::string::npos) << selector << " in " << reset;
    }
  }
}

TEST(ReportHtml, TopViewOnAPhoneIsNarrower) {
  const XmlElement page = parse_strictly(report_html(test::full_record()));
  std::size_t on_page = 0;
  std::size_t on_phone = 0;
  for (const XmlElement* part : page.all("div")) {
    const auto css = part->attributes.find("class");
    if (css == part->attributes.end()) continue;
    if (css->second.find("on-page") != std::string::npos) on_page += part->all("svg").size();
    if (css->second != "on-phone") continue;
    on_phone += part->all("svg").size();
    const std::string box = part->all("svg").at(0)->attributes.at("viewBox");
    EXPECT_TRUE(box.starts_with("0 0 360 "))
        << "as wide as a phone's page, so that text keeps its size: " << box;
  }
  EXPECT_EQ(on_page, 1U);
  EXPECT_EQ(on_phone, 1U);
  EXPECT_NE(picture_style().find("\n.on-phone{display:none}"), std::string_view::npos);
  EXPECT_NE(phone_block().find(".on-page{display:none}"), std::string::npos);
  EXPECT_NE(phone_block().find(".on-phone{display:block}"), std::string::npos);
}

TEST(ReportHtml, TopViewNeedsAWorld) {
  RunRecord record;
  EXPECT_EQ(report_html(record).find("The world from above"), std::string::npos);
  record.top_view.emplace();
  EXPECT_EQ(report_html(record).find("The world from above"), std::string::npos);
  record.top_view->shapes = {{Layer::pole, "pole", {{0, 0}, {1, 0}, {1, 1}}}};
  EXPECT_NE(report_html(record).find("The world from above"), std::string::npos);
}

}  // namespace
}  // namespace hil::report
