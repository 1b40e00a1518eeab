#include "sample_record.hpp"

#include <cmath>
#include <numbers>

namespace hil::report::test {
namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr std::int64_t millisecond = 1'000'000;

Quantiles quantiles(std::uint64_t samples, std::int64_t p50, std::int64_t p99, std::int64_t p999,
                    std::int64_t max) {
  return {samples, p50, p99, p999, max};
}

Task task(const char* name, double rate_hz, std::int64_t deadline_ns, std::int64_t budget_ns,
          const char* policy) {
  Task task;
  task.name = name;
  task.rate_hz = rate_hz;
  task.deadline_ns = deadline_ns;
  task.budget_ns = budget_ns;
  task.overrun_policy = policy;
  return task;
}

/// `count` samples around `middle_ns` with a long tail.
Histogram tailed_histogram(std::int64_t middle_ns, std::uint64_t count) {
  const std::uint64_t tail = count / 100;
  return {{middle_ns / 2, middle_ns - 1, count / 2},
          {middle_ns, 2 * middle_ns - 1, count - count / 2 - tail},
          {8 * middle_ns, 16 * middle_ns - 1, tail}};
}

/// The quantiles of such a histogram, by the upper edges of its bins.
Quantiles quantiles_of_tailed(const Histogram& histogram) {
  if (histogram.empty()) return {};
  return {histogram[0].count + histogram[1].count + histogram[2].count, histogram[0].last_ns,
          histogram[1].last_ns, histogram[2].last_ns, histogram[2].last_ns};
}

void measure(Task& task, const TaskHistograms& histograms) {
  task.histograms = histograms;
  task.wake_latency_ns = quantiles_of_tailed(histograms.wake_latency_ns);
  task.wall_ns = quantiles_of_tailed(histograms.wall_ns);
  task.cpu_ns = quantiles_of_tailed(histograms.cpu_ns);
  task.blocked_ns = quantiles_of_tailed(histograms.blocked_ns);
}

std::vector<Task> tasks() {
  Task traffic = task("traffic", 1000.0, millisecond, 200'000, "skip");
  traffic.runs = 9'900;
  traffic.warmup_runs = 100;
  traffic.deadline_misses = 2;
  traffic.overruns = 1;
  traffic.skipped = 1;
  traffic.over_budget = 3;
  traffic.without_result = 6;
  traffic.discarded = 4;
  traffic.hard_misses = 2;
  traffic.first_hard_misses = {{40, "own work", 12'000}, {512, "waited for other transactions", 400'000}};
  traffic.worst_hard_miss = traffic.first_hard_misses.back();
  traffic.slack_ns = {9'900, -402'113, 951'000};
  measure(
      traffic,
      {tailed_histogram(6'000, 9'900), tailed_histogram(41'000, 9'900), tailed_histogram(39'000, 9'900), {}});
  traffic.warmup_problems = 4;
  traffic.misses_by_cause = {{"late wake-up", 1}, {"own work", 1}};
  traffic.worst_lateness_ns = 402'113;
  traffic.misses = {{3'117, "late wake-up", 402'113}, {7'040, "own work", 12'400}};

  Task scanner = task("scanner", 100.0, 10 * millisecond, 8 * millisecond, "skip");
  scanner.thread = "scanner";
  scanner.runs = 990;
  scanner.warmup_runs = 10;
  scanner.deadline_misses = 1;
  scanner.page_faults = 4;
  scanner.gpu_ns = quantiles(990, 4'510'000, 7'010'000, 8'600'000, 9'800'000);
  scanner.slack_ns = {990, -870'000, 4'760'000};
  measure(scanner, {tailed_histogram(9'800, 990), tailed_histogram(5'200'000, 990),
                    tailed_histogram(310'000, 990), tailed_histogram(4'800'000, 990)});
  scanner.misses_by_cause = {{"database", 1}};
  scanner.worst_lateness_ns = 870'000;
  scanner.misses = {{4'200, "database", 870'000}};

  Task detectors = task("detectors", 50.0, 20 * millisecond, 0, "queue");
  detectors.runs = 495;
  detectors.warmup_runs = 5;
  detectors.slack_ns = {495, 18'700'000, 19'350'000};
  measure(detectors, {tailed_histogram(6'400, 495), tailed_histogram(640'000, 495), {}, {}});
  return {traffic, scanner, detectors};
}

std::vector<PointM> rectangle(double x_m, double y_m, double length_m, double width_m,
                              double heading_rad = 0.0) {
  std::vector<PointM> corners;
  for (const auto& [along, across] : {std::pair{0.5, 0.5}, {-0.5, 0.5}, {-0.5, -0.5}, {0.5, -0.5}}) {
    const double forward = along * length_m;
    const double left = across * width_m;
    corners.push_back({x_m + forward * std::cos(heading_rad) - left * std::sin(heading_rad),
                       y_m + forward * std::sin(heading_rad) + left * std::cos(heading_rad)});
  }
  return corners;
}

Track straight_track(const char* name, bool ego, PointM from, PointM to) {
  Track track{name, ego, {}};
  for (int step = 0; step <= 100; ++step) {
    const double share = step / 100.0;
    track.points.push_back({step * 100 * millisecond, from.x_m + share * (to.x_m - from.x_m),
                            from.y_m + share * (to.y_m - from.y_m)});
  }
  return track;
}

TopView crossing() {
  TopView view;
  view.time_ns = 10'000 * millisecond;
  const double north = std::numbers::pi / 2.0;
  view.shapes = {{Layer::ground, "ground", rectangle(0, 0, 400, 400)},
                 {Layer::road, "", rectangle(0, 0, 400, 8)},
                 {Layer::road, "", rectangle(0, 0, 8, 400)},
                 {Layer::marking, "", rectangle(-6, -2, 0.4, 4)},
                 {Layer::detector, "loop ego", rectangle(-10, -2, 4, 3)},
                 {Layer::structure, "house_south_east", rectangle(28, -22, 30, 20)},
                 {Layer::structure, "house_south_west", rectangle(-28, -22, 30, 20)},
                 {Layer::structure, "house_north_west", rectangle(-28, 22, 30, 20)},
                 {Layer::pole, "light", rectangle(-6, -5.4, 0.4, 0.4)},
                 {Layer::vehicle, "car_1", rectangle(2, 14, 4.5, 1.8, north), "vehicle"},
                 {Layer::vehicle, "car_2", rectangle(2, 24, 4.5, 1.8, north)},
                 {Layer::ego, "ego", rectangle(-11, -2, 4.6, 1.9)}};
  view.tracks = {straight_track("ego", true, {-50, -2}, {-11, -2}),
                 straight_track("car_1", false, {2, -60}, {2, 14}),
                 straight_track("car_2", false, {2, -52}, {2, 24})};
  view.fan = FieldOfView{{-9.5, -2}, 70 * degree, -70 * degree, 40.0};
  for (int step = 0; step < 60; ++step) {
    view.scan_points.push_back({1.1, 11.6 + step * 0.08, 0.6, 0, 0, 15.0, 1});
    view.scan_points.push_back({13.0, -12.0 - step * 0.14, 2.0, 0, 0, 24.0, 2});
  }
  return view;
}

/// The side of a car, `measured_m` long, in front of a wall, seen by a scanner 1.2 m above the ground.
Picture scan_of_car(const char* title, const char* caption, double measured_m) {
  Picture picture{
      .title = title,
      .caption = caption,
      .entities = {"ground", "car_1", "house"},
      .subject = 1,
      .right = {0.0, -1.0},
      .outline_length_m = 4.5,
      .dimensions = {{"measured", measured_m}, {"closed form", measured_m + 0.021}, {"true length", 4.5}},
      .points = {}};
  const auto add = [&](double x_m, double y_m, double z_m, std::uint32_t entity) {
    picture.points.push_back({x_m, y_m, z_m, std::atan2(y_m, x_m), std::atan2(z_m - 1.2, x_m),
                              std::hypot(x_m, y_m, z_m - 1.2), entity});
  };
  for (int column = 0; column <= 100; ++column) {
    for (int row = 0; row < 12; ++row) {
      add(14.0, (0.5 - 0.01 * column) * measured_m, 0.3 + 0.1 * row, 1U);
      add(26.0, 30.0 - 0.6 * column, 0.7 * row, 2U);
    }
  }
  return picture;
}

ResponseTime response() {
  ResponseTime response{"DUT answers within 50 ms", 50 * millisecond, {}, 0};
  for (int sample = 0; sample < 400; ++sample)
    response.samples_ns.push_back(4 * millisecond + sample * sample * 230);
  return response;
}

}  // namespace

BusGroup can_group(const std::vector<buses::can::CanRecord>& all) {
  BusGroup group{.list_key = "can", .title = "CAN", .name_key = "bus", .columns = buses::can::can_columns()};
  for (const buses::can::CanRecord& facts : all)
    group.buses.push_back(to_record(facts));
  return group;
}

BusGroup modbus_group(const std::vector<buses::modbus::UnitRecord>& all) {
  BusGroup group{
      .list_key = "modbus", .title = "Modbus", .name_key = "unit", .columns = buses::modbus::unit_columns()};
  for (const buses::modbus::UnitRecord& facts : all)
    group.buses.push_back(to_record(facts));
  return group;
}

RunRecord full_record() {
  RunRecord record;
  record.scenario = {
      "crossing", "configs/crossing/crossing.yaml",
      "An ego car with a laser scanner drives toward a crossing; one car from the right runs its red light."};
  record.verdict = Verdict::failed;
  record.reason = "1 of 2 expectations did not hold: no collision.";
  record.exit_code = 1;
  record.program_version = "0.1.0";
  record.plugins = {{"pumps", "1.2.3", "/opt/hil/plugins/pumps.so", "00ff00ff00ff00ff"}};
  record.clock = "realtime";
  record.ticks = 9'980;
  record.skipped_ticks = 20;
  record.run_time_ns = 10'000 * millisecond;
  record.period_ns = millisecond;
  record.duration_ns = 10'000 * millisecond;
  record.started_at = "2025-03-01T12:34:56Z";
  record.wall_ns = 10'021 * millisecond;
  record.seed = 1;
  record.overrides = {{"dut.enabled", "false"}};
  record.realtime = {
      "SCHED_OTHER",
      0,
      false,
      {2, 3},
      "Linux 6.1.0-18-amd64",
      {"SCHED_FIFO at priority 60 was refused (Operation not permitted); the run used SCHED_OTHER.",
       "Memory could not be locked: RLIMIT_MEMLOCK is 8 MiB."}};
  record.gpu = {"llvmpipe (LLVM 15.0.6, 256 bits)", "Mesa 22.3.6", "Vulkan 1.3.230"};
  record.tasks = tasks();
  record.base_stages = {
      {"latch inputs", 24 * millisecond, quantiles(10'000, 2'300, 4'000, 9'000, 21'000)},
      {"tasks", 770 * millisecond, quantiles(10'000, 71'000, 160'000, 700'000, 1'300'000)},
      {"release outputs", 31 * millisecond, quantiles(10'000, 2'900, 6'000, 11'000, 30'000)},
      {"idle", 9'175 * millisecond, quantiles(10'000, 921'000, 975'000, 980'000, 981'000)}};
  record.watchdog = {{7'041 * millisecond, "no tick for 20 ms; outputs set to their safe values"}};
  record.watchdog_not_listed = 3;
  record.transactions = {12'345, 12'340, 2, 1, 1, 0, 0, 1, 0, 0, 0, 2};
  record.scheduler = {
      1'200,
      1'199,
      1,
      3,
      {{"ray_closest", 6'000, 0.9, 1.0, 1.2}},
      {{"traffic", millisecond, millisecond, 108'000, 10'000, 9'998, 1, 1, 0, 61'000, 402'000}},
      {"reservation 'scan' can not be kept"}};
  record.database_log = {
      "async",   17,          10'015,     10'010,
      4'158'976, 221,         2,          1,
      3'993'027, 123'931'859, 16'777'216, 28'288,
      1,         5,           3,          "write of segment.0000000002: Input/output error"};
  const buses::can::CanRecord car{
      .bus = "car",
      .driver = "virtual",
      .rx = 1'000,
      .tx = 3'021,
      .dropped = 0,
      .errors = 0,
      .no_buffer = 0,
      .bad_checksum = 2,
      .bad_counter = 1,
      .unknown_id = 0,
      .bus_load_mean = 0.124,
      .bus_load_peak = 0.31,
      .send_errors = 1,
      .send_fault = "message EgoStatus could not be sent on CAN bus 'car': Invalid argument",
      .wrong_kind = 3,
      .saturated = 5,
      .refused_values = 7,
      .dropped_releases = 11,
      .log_dropped = 13,
      .lost_arrivals = 17,
      .fault_dropped_tx = 19,
      .fault_dropped_rx = 23,
      .fault_corrupted = 29,
      .fault_delayed = 1'031,
      .played = 1'033,
      .play_unknown_id = 1'039,
      .play_unsent = 43,
      .other_lengths = {{"BrakeCommand", 37, 41}},
      .rejected = {{"BrakeCommand", 47, 53, 59, 61}}};
  buses::modbus::UnitRecord plc;
  plc.name = "plc";
  plc.role = "client";
  plc.requests = 400;
  plc.replies = 398;
  plc.timeouts = 2;
  plc.errors = 3;
  plc.reconnects = 1;
  plc.exceptions = {{2, 1, "reading level (holding 10)"}, {6, 2, "writing valve (coil 3)"}};
  plc.saturated_outputs = 4;
  plc.out_of_range_inputs = 5;
  plc.not_a_number_outputs = 6;
  plc.not_a_number_inputs = 7;
  plc.superseded = 8;
  plc.stale = 9;
  buses::modbus::UnitRecord panel;
  panel.name = "panel";
  panel.role = "server";
  panel.requests = 90;
  panel.replies = 89;
  panel.errors = 6;
  panel.exceptions = {{3, 5, ""}};
  panel.connections = 70;
  panel.refused_connections = 10;
  panel.replaced_connections = 11;
  panel.dropped_connections = 12;
  record.buses = {can_group({car}), modbus_group({plc, panel})};
  using Rows = std::vector<contribution::BusRow>;
  record.buses[0].buses[0].fields.push_back({"inputs", Rows{{{"input", "BrakeCommand"},
                                                             {"ticks", std::uint64_t{9'980}},
                                                             {"not_fresh", std::uint64_t{611}},
                                                             {"rejected", std::uint64_t{159}},
                                                             {"rejected_by_scenario", std::uint64_t{61}}}}});
  record.processes = {
      {"dut", "hil-aeb-controller --bus /tmp/car.sock --database crossing.dbc",
       "was ended by signal 11 (Segmentation fault)", 6'210 * millisecond},
      {"plc", "hil-crossing-plc --listen 127.0.0.1:40213", "exited with code 0", std::nullopt}};
  record.expectations = {{"no collision", ExpectationResult::failed, "collision.ego was 1",
                          8'412 * millisecond, 8'413, 10'000, std::nullopt, -0.25, "m", 8'420 * millisecond},
                         {"DUT answers within 50 ms", ExpectationResult::held, "400 answers, slowest 41.2 ms",
                          std::nullopt, 9'900, 10'000}};
  record.expectations[1].not_evaluated = {{.begin_ns = 100 * millisecond,
                                           .end_ns = 199 * millisecond,
                                           .signals = {"can.car.BrakeCommand.AnswerTo"}}};
  record.expectations[1].figures = {
      {.name = "mean", .value = 12.5, .unit = "m/s", .min = 10.0, .max = std::nullopt, .is_held = true}};
  record.expectations[1].shift_ns = 3 * millisecond;
  record.stimuli = {{"profile",
                     "can.car.EgoStatus.Speed",
                     "",
                     1,
                     0,
                     10'000 * millisecond,
                     {{0, 10'000 * millisecond}},
                     std::nullopt,
                     true,
                     "'can.car.EgoStatus.Speed' (read every 20 ms) was not read during its part 'peak'"}};
  record.faults = {{"stuck",
                    "scanner.object0.x",
                    "stuck at its last value",
                    2,
                    3'000 * millisecond,
                    1'250 * millisecond,
                    {{3'000 * millisecond, 4'000 * millisecond}, {9'750 * millisecond, 10'000 * millisecond}},
                    std::nullopt,
                    true},
                   {"late",
                    "can.car.EgoStatus",
                    "delayed by 20 ms",
                    1,
                    4'000 * millisecond,
                    500 * millisecond,
                    {{4'000 * millisecond, 4'500 * millisecond}},
                    50,
                    false,
                    "it changed none of the frames or requests that came in that time (50)"},
                   {"noisy", "traffic.ego.speed", "noise of 1 m/s", 0, std::nullopt, 0}};
  record.faults[2].test_table = "checks";
  record.losses = {{"Modbus unit plc", 3'200 * millisecond, 1'500 * millisecond, false, true, "cut", ""},
                   {"process dut", 6'210 * millisecond, 3'790 * millisecond, true, false, "",
                    "was ended by signal 11 (Segmentation fault)"}};
  record.losses_not_listed = 2;
  record.input_failures = {"message can.car.BrakeCommand was not fresh on 611 of 9980 ticks"};
  record.failures = {
      "process dut was lost from 6.210 s on for 3.79 s, to the end of the run: was ended by signal 11 "
      "(Segmentation fault)"};
  record.response_times = {response()};
  record.events = {{2'000 * millisecond, "light_cross turns red"},
                   {4'310 * millisecond, "car_1 runs its red light"},
                   {6'210 * millisecond, "dut was ended by signal 11 (Segmentation fault)"},
                   {8'412 * millisecond, "ego collides with car_1"}};
  record.events_not_listed = 1'049;
  record.top_view = crossing();
  record.sections = {
      {.name = "scan",
       .title = "What the scanner sees of a moving car",
       .text = "Each beam has its own instant.",
       .images = {{.title = "front",
                   .caption = "Tick 9900, 9.900 s.",
                   .png = "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAIAAAB7QOjdAAAAD0lEQVR4nGP4"
                          "z8DA8J8BAAf/Af8Bf4mnAAAAAElFTkSuQmCC"}},
       .pictures = {scan_of_car("Motion ignored", "The car as it is in the middle of the scan.", 4.487),
                    scan_of_car("With the scan", "The car drives with the beam: elongated.", 5.9),
                    scan_of_car("Against the scan", "The car drives against the beam: compressed.", 3.6)},
       .plots = {{.title = "Measured length over speed",
                  .caption = "Two cars.",
                  .x = {.quantity = "speed", .unit = "m/s"},
                  .y = {.quantity = "length", .unit = "m", .logarithmic = true},
                  .series = {{.name = "with the scan", .points = {{1.0, 4.6}, {5.0, 5.2}, {9.0, 5.9}}},
                             {.name = "against the scan", .points = {{1.0, 4.4}, {9.0, 3.6}}}}}},
       .tables = {{.columns = {{.title = "Case"},
                               {.title = "Measured", .numeric = true, .unit = "m", .decimals = 3},
                               {.title = "Tolerance", .numeric = true, .unit = "m", .decimals = 3},
                               {.title = "Result"}},
                   .rows = {{{.text = "Motion ignored"},
                             {.number = 4.4871},
                             {},
                             {.text = "agrees", .mark = contribution::Mark::good}},
                            {{.text = "With the scan"},
                             {.number = 5.9},
                             {.number = 0.12},
                             {.text = "differs", .mark = contribution::Mark::bad}}}}}}};
  // PNGs of two pixels, red and green.
  record.views = {{.name = "corner",
                   .time_ns = 9'987 * millisecond,
                   .exposure_value = 13.5,
                   .in_daylight = true,
                   .lights_overflow = true,
                   .incomplete_pixels = 3,
                   .file = "images/view-corner.png",
                   .image_png = "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAIAAAB7QOjdAAAAD0lEQVR4nGP4"
                                "z8DA8J8BAAf/Af8Bf4mnAAAAAElFTkSuQmCC"}};
  record.lists = {{.list = "cameras",
                   .name = "front",
                   .properties = {{"images", std::int64_t{301}},
                                  {"dropped", std::int64_t{5}},
                                  {"beyond_limit", std::int64_t{6}},
                                  {"missing_tiles", std::int64_t{7}},
                                  {"exposure_value", 12.5},
                                  {"last_file", std::string("images/camera-front-009900.png")},
                                  {"last_time_ns", 9'900 * millisecond},
                                  {"last_tick", std::int64_t{9'900}}}},
                  {.list = "cameras",
                   .name = "rear",
                   .properties = {{"images", std::int64_t{20}}, {"last_time_ns", not_known}}}};
  record.recording = Recording{.file = "recording.mcap",
                               .bytes = 1'048'571,
                               .messages = 12'347,
                               .dropped = 43,
                               .stopped_at_ns = 9'871 * millisecond,
                               .not_recorded = 1'234};
  record.signal_plots = {
      .series =
          {{.name = "ego.speed",
            .unit = "m/s",
            .named_values = {},
            .begin_ns = 0,
            .bucket_ns = 5 * millisecond,
            .points = {{0, 10.5, 10.5}, {7, 10.25, 11.75}, {8, not_known, not_known}, {1999, 3.0, 3.0}}},
           {.name = "ego.speed.faulted",
            .kind = SeriesKind::faulted,
            .unit = "m/s",
            .named_values = {},
            .begin_ns = 0,
            .bucket_ns = 5 * millisecond,
            .points = {{0, 10.5, 10.5}, {1999, 4.0, 4.0}}},
           {.name = "ego.speed",
            .kind = SeriesKind::reference,
            .unit = "m/s",
            .tolerance = 0.5,
            .named_values = {},
            .begin_ns = 0,
            .bucket_ns = 5 * millisecond,
            .points = {{0, 10.0, 10.0}, {1000, 12.0, 12.0}, {1999, 4.0, 4.0}}},
           {.name = "plc.light",
            .unit = "",
            .named_values = {{0.0, "red"}, {1.0, "green"}},
            .begin_ns = 0,
            .bucket_ns = 10 * millisecond,
            .points = {{0, 0.0, 0.0}, {999, 1.0, 1.0}}}},
      .plots = {{.title = "no collision",
                 .expectations = {0},
                 .series = {0, 1, 2, 3},
                 .limits = {{.series = 0, .value = 12.5}},
                 .instants = {{.series = 0, .time_ns = 5'000 * millisecond, .value = 12.0, .tolerance = 0.5}},
                 .begin_ns = 0,
                 .end_ns = 10'000 * millisecond}},
      .not_plotted = {"the light is green at last"}};
  return record;
}

}  // namespace hil::report::test
