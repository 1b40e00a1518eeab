// Wrong command lines: one sentence says what is wrong and what is allowed.

#include <gtest/gtest.h>

#include "tests/system/scenario/hil.hpp"

namespace hil::scenario_test {
namespace {

struct Case {
  std::vector<std::string> words;
  const char* sentence;
};

void expect_sentence(const Case& wrong) {
  const Ended ended = run_hil(wrong.words);
  EXPECT_EQ(ended.code, 2) << wrong.sentence;
  EXPECT_EQ(ended.errors, std::string(wrong.sentence) + "\n");
  EXPECT_EQ(ended.output, "");
}

TEST(Usage, UnknownCommandListsTheCommands) {
  const Case cases[] = {
      {{"chek", "x"},
       "hil: 'chek' is not a command of hil; did you mean 'check'? Known here: check, run, report, history, "
       "db, doctor, keys, new"},
      {{"history", "d", "signals"},
       "hil history: 'signals' is not a command of hil history; known here: info, entities, near, region, "
       "ray, image, scan"},
      {{"history", "d", "ner", "x", "--at", "1s"},
       "hil history: 'ner' is not a command of hil history; did you mean 'near'? Known here: near, info, "
       "entities, region, ray, image, scan"},
      {{"db", "verfy", "d"},
       "hil db: 'verfy' is not a command of hil db; did you mean 'verify'? Known here: verify, info, export"},
      {{}, "hil: a command is missing; known here: run, check, report, history, db, doctor, keys, new"},
      {{"history", "d"},
       "hil history: a command is missing; known here: info, entities, near, region, ray, image, scan"},
  };
  for (const Case& wrong : cases)
    expect_sentence(wrong);
}

TEST(Usage, RefusedArgumentsOfARunLeaveJunitXmlInItsFolder) {
  const std::vector<std::vector<std::string>> refused{{"run", "drive.yaml", "--durtion", "5s"},
                                                      {"run", "drive.yaml", "y"},
                                                      {"run", "drive.yaml", "--seed", "1", "--seed", "2"},
                                                      {"run", "drive.yaml", "--fail-on", "msses > 0"},
                                                      {"run", "nothing.yaml"},
                                                      {"run"}};
  for (const std::vector<std::string>& words : refused) {
    const Folder folder;
    write_text(folder / "report.json", "of an earlier run");
    const Ended ended = run_hil(joined({words, {"--out", folder.path().string()}}));
    EXPECT_EQ(ended.code, 2) << ended.errors;
    const std::string junit = read_text(folder / "junit.xml");
    EXPECT_NE(junit.find("tests=\"1\" failures=\"0\" errors=\"1\""), std::string::npos) << junit;
    EXPECT_NE(junit.find("<error "), std::string::npos) << junit;
    EXPECT_EQ(junit.find("<error "), junit.rfind("<error ")) << junit;
    EXPECT_FALSE(std::filesystem::exists(folder / "report.json"));
    EXPECT_EQ(run_hil(words).code, 2) << "without a folder";
  }
  const Folder folder;
  EXPECT_EQ(run_hil({"check", "nothing.yaml", "--out", folder.path().string()}).code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder / "junit.xml")) << "only a run has a folder";
}

TEST(Usage, UnknownOptionListsTheOptions) {
  const Case cases[] = {
      {{"run", "x", "--durtion", "5s"},
       "hil run: there is no option '--durtion'; did you mean '--duration'? Known here: --duration, --help, "
       "--clock, --out, --set, --add, --fail-on, --verbose, --seed"},
      {{"run", "x", "--durtion=5s"},
       "hil run: there is no option '--durtion'; did you mean '--duration'? Known here: --duration, --help, "
       "--clock, --out, --set, --add, --fail-on, --verbose, --seed"},
      {{"history", "d", "entities", "--att", "1s"},
       "hil history entities: there is no option '--att'; did you mean '--at'? Known here: --at, --help, "
       "--gpu, --until, --every, --known-at, --json, --salvage"},
      {{"--hlp"}, "hil: there is no option '--hlp'; did you mean '--help'? Known here: --help, --version"},
      {{"run", "x", "y"}, "hil run: 'y' is one argument too many; hil run --help lists the arguments"},
  };
  for (const Case& wrong : cases)
    expect_sentence(wrong);
}

TEST(Usage, DuplicateOptionIsReportedWithItsValues) {
  const Case cases[] = {
      {{"run", "x", "--seed", "1", "--seed", "2"},
       "hil run: --seed is given twice: '1' and '2'; give it once"},
      {{"run", "x", "--fail-on", "misses > 0", "--fail-on=skipped > 0"},
       "hil run: --fail-on is given twice: 'misses > 0' and 'skipped > 0'; give it once"},
      {{"run", "x", "--duration=1s", "--duration", "2s", "--duration", "3s"},
       "hil run: --duration is given 3 times: '1s', '2s' and '3s'; give it once"},
      {{"history", "d", "entities", "--at", "1s", "--at", "2s"},
       "hil history entities: --at is given twice: '1s' and '2s'; give it once"},
      {{"history", "d", "near", "x", "--at", "1s", "--from", "1,2,3", "--from", "4,5,6"},
       "hil history near: --from takes 3 values, and 6 are given: '1', '2', '3', '4', '5' and '6'; give it "
       "once"},
  };
  for (const Case& wrong : cases)
    expect_sentence(wrong);
}

TEST(Usage, HelpAndVersionSucceed) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"--help"}, {"--version"}, {"run", "--help"}}) {
    const Ended ended = run_hil(words);
    EXPECT_EQ(ended.code, 0);
    EXPECT_EQ(ended.errors, "");
    EXPECT_NE(ended.output, "");
  }
}

}  // namespace
}  // namespace hil::scenario_test
