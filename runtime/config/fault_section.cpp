#include "runtime/config/fault_section.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "runtime/config/reading.hpp"
#include "runtime/config/shared_schemas.hpp"
#include "runtime/config/text_lists.hpp"

namespace hil::config {
namespace {

struct TargetWord {
  FaultTarget target;
  const char* key;
  const char* article;
};
constexpr std::array<TargetWord, 5> target_words{{
    {FaultTarget::signal, "signal", "a signal"},
    {FaultTarget::message, "message", "a message"},
    {FaultTarget::device, "device", "a device"},
    {FaultTarget::process, "process", "a process"},
    {FaultTarget::task, "task", "a task"},
}};

const TargetWord& word_of_target(FaultTarget target) {
  return *std::ranges::find(target_words, target, &TargetWord::target);
}

/// A kind, and the key of the type of bus that declares it; empty: no bus does.
struct DeclaredKind {
  const FaultKind* kind = nullptr;
  std::string_view bus{};
};

/// Those of signals, of each type of bus, then the others.
std::vector<std::vector<DeclaredKind>> tables_of(const ScenarioTypes& types) {
  std::vector<std::vector<DeclaredKind>> tables(1);
  for (const FaultKind& kind : types.faults)
    if (kind.target == FaultTarget::signal) tables.back().push_back({&kind});
  for (const BusSectionType& type : types.buses) {
    tables.emplace_back();
    for (const FaultKind& kind : type.faults)
      tables.back().push_back({&kind, type.key});
  }
  tables.emplace_back();
  for (const FaultKind& kind : types.faults)
    if (kind.target != FaultTarget::signal) tables.back().push_back({&kind});
  return tables;
}

std::vector<DeclaredKind> kinds_of(const ScenarioTypes& types) {
  std::vector<DeclaredKind> all;
  for (const std::vector<DeclaredKind>& table : tables_of(types))
    all.insert(all.end(), table.begin(), table.end());
  return all;
}

bool is_whole_sentence(const FaultKind& kind) {
  return !kind.word.empty() || kind.about.ends_with('.');
}

/// The keys of all kinds, each once. In a table those whose sentence other tables complete are the last.
std::vector<std::string> keys_of(const ScenarioTypes& types) {
  std::vector<std::string> keys;
  for (std::vector<DeclaredKind>& table : tables_of(types)) {
    std::ranges::stable_partition(table,
                                  [](const DeclaredKind& one) { return is_whole_sentence(*one.kind); });
    for (const DeclaredKind& one : table)
      if (std::ranges::find(keys, one.kind->key) == keys.end()) keys.push_back(one.kind->key);
  }
  return keys;
}

/// "Of a Modbus unit: silent or disconnected. Of a process: paused or killed."
std::string about_words(const std::vector<const FaultKind*>& kinds) {
  std::string about;
  for (auto first = kinds.begin(); first != kinds.end();) {
    const std::string& subject = (*first)->subject;
    const auto end =
        std::find_if(first, kinds.end(), [&](const FaultKind* kind) { return kind->subject != subject; });
    std::vector<std::string> words;
    for (; first != end; ++first)
      words.push_back((*first)->about);
    about += (about.empty() ? "Of " : " Of ") + subject + ": " + text_list(words, "or") + ".";
  }
  return about;
}

/// The sentences of the kinds, or the one that they have together.
std::string about_key(const std::vector<const FaultKind*>& kinds) {
  std::string about;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const bool is_last = i + 1 == kinds.size();
    if (i > 0) about += is_whole_sentence(*kinds[i]) ? " " : is_last ? ", or " : ", ";
    about += kinds[i]->about;
  }
  return about.ends_with('.') ? about : about + ".";
}

Field key_field(const std::string& key, const std::vector<DeclaredKind>& all) {
  std::vector<const FaultKind*> kinds;
  std::vector<std::string> words;
  for (const DeclaredKind& one : all) {
    if (one.kind->key != key) continue;
    kinds.push_back(one.kind);
    if (!one.kind->word.empty() && std::ranges::find(words, one.kind->word) == words.end())
      words.push_back(one.kind->word);
  }
  if (words.empty()) return Field::optional(key, kinds.front()->schema(), about_key(kinds));
  return Field::optional(key, Schema::one_of(words), about_words(kinds));
}

Schema fault_schema(const ScenarioTypes& types) {
  std::vector<Field> common{
      Field::needed("name", Schema::name(), "The fault's name. 'fault.NAME' is 1 while it is active."),
      Field::optional("signal", Schema::signal(), "The signal that readers read wrongly."),
      Field::optional(
          "message", Schema::text(),
          "A message that a CAN bus sends, receives or plays: 'can.car.BrakeCommand', or by its identifier "
          "'can.car.0x123' of 11 bits; one of more than three digits has 29 bits."),
      Field::optional("device", Schema::signal(), "A bus or a Modbus unit: 'can.car', 'modbus.plc'."),
      Field::optional("process", Schema::name(), "A process that the run starts."),
      Field::optional("task", Schema::name(), "The task of a module."),
      Field::with_default("readers", Schema::list(Schema::signal()), "[]",
                          "Of a signal: modules, buses ('can.car') or their inputs ('control.level'). Left "
                          "out: all modules and buses that read the signal."),
  };
  add_activation_fields(common);
  const std::vector<DeclaredKind> all = kinds_of(types);
  std::vector<Field> keys;
  for (const std::string& key : keys_of(types))
    keys.push_back(key_field(key, all));
  return keys.empty() ? Schema::record(common) : Schema::exactly_one(keys, common);
}

/// Empty with a mistake.
const TargetWord* target_of(const Value& section, Diagnostics& diagnostics) {
  const TargetWord* found = nullptr;
  for (const TargetWord& word : target_words) {
    if (!section.has(word.key)) continue;
    if (found != nullptr) {
      diagnostics.add(section[word.key].place(),
                      std::string("'") + found->key + "' and '" + word.key + "' exclude each other");
      return nullptr;
    }
    found = &word;
  }
  if (found == nullptr) {
    diagnostics.add(section.place(),
                    "a fault needs its target: 'signal', 'message', 'device', 'process' or 'task'");
  }
  return found;
}

class EffectReader {
 public:
  EffectReader(const Value& section, const FaultSection& fault, ReaderContext& reading)
      : key_(section.chosen()),
        value_(section[key_]),
        fault_(fault),
        target_(word_of_target(fault.target)),
        reading_(reading),
        kinds_(kinds_of(reading.types)) {}

  std::shared_ptr<const FaultEffect> read() {
    const FaultKind* const kind = find();
    if (kind == nullptr) return nullptr;
    return kind->read(value_, {.period_ns = reading_.base ? reading_.base->period_ns : 0,
                               .activation = fault_.activation,
                               .diagnostics = reading_.diagnostics});
  }

 private:
  /// Null with a mistake. A word of another target is a mistake, too, but its value is read.
  const FaultKind* find() {
    const FaultKind *found = nullptr, *of_other_target = nullptr;
    const std::string_view bus =
        std::string_view(fault_.subject.text).substr(0, fault_.subject.text.find('.'));
    bool has_key = false;
    for (const DeclaredKind& one : kinds_) {
      if (one.kind->key != key_) continue;
      has_key |= one.kind->target == fault_.target;
      if (!one.kind->word.empty() && one.kind->word != value_.text()) continue;
      if (one.kind->target != fault_.target)
        of_other_target = one.kind;
      else if (found == nullptr || one.bus == bus)
        found = one.kind;
    }
    if (found != nullptr) return found;
    if (!has_key) {
      refuse(" has no fault '" + key_ + "'; it has " + text_list(keys()));
      return nullptr;
    }
    // Devices of different types have different words.
    const std::string hint = fault_.target == FaultTarget::device
                                 ? std::string(word_of_target(of_other_target->target).article) + " can"
                                 : "it can be " + text_list(words(), "or");
    refuse(" can not be " + value_.text() + "; " + hint);
    return of_other_target;
  }

  void refuse(const std::string& sentence) {
    reading_.diagnostics.add(value_.place(), target_.article + sentence);
  }
  /// Of the target.
  std::vector<std::string> keys() const {
    std::vector<std::string> keys;
    for (const DeclaredKind& one : kinds_) {
      if (one.kind->target == fault_.target && std::ranges::find(keys, one.kind->key) == keys.end())
        keys.push_back(one.kind->key);
    }
    return keys;
  }
  std::vector<std::string> words() const {
    std::vector<std::string> words;
    for (const DeclaredKind& one : kinds_)
      if (one.kind->target == fault_.target && one.kind->key == key_) words.push_back(one.kind->word);
    return words;
  }

  const std::string& key_;
  const Value& value_;
  const FaultSection& fault_;
  const TargetWord& target_;
  ReaderContext& reading_;
  const std::vector<DeclaredKind> kinds_;
};

}  // namespace

double read_fault_share(const Value& share, const std::string& key, Diagnostics& diagnostics) {
  if (share.number() == 0.0)
    diagnostics.add(share.place(), "'" + key + "': 0 % changes nothing; a fault has a share above 0 %");
  return share.number();
}

Schema faults_schema(const ScenarioTypes& types) {
  return Schema::list(fault_schema(types));
}

void read_faults(const Value& root, Scenario& scenario, ReaderContext& reading) {
  const Value* const list = part_of(root, "faults");
  if (list == nullptr) return;
  UniqueNames names("fault", reading.diagnostics);
  for (const Value& section : list->items()) {
    if (const std::optional<Word> name = word_in(section, "name")) names.add(*name);
    if (!is_whole(section)) continue;
    const std::size_t before = reading.diagnostics.count();
    FaultSection fault{.name = word_of(section["name"])};
    read_activation(section, fault.activation, scenario, reading.diagnostics);
    if (const TargetWord* const target = target_of(section, reading.diagnostics)) {
      fault.target = target->target;
      fault.subject = word_of(section[target->key]);
      fault.place = section[section.chosen()].place();
      fault.effect = EffectReader(section, fault, reading).read();
    }
    for (const Value& reader : section["readers"].items())
      fault.readers.push_back(word_of(reader));
    if (!fault.readers.empty() && fault.target != FaultTarget::signal)
      reading.diagnostics.add(section["readers"].place(), "'readers' belongs to the fault of a signal");
    if (reading.diagnostics.count() == before) scenario.faults.push_back(std::move(fault));
  }
}

}  // namespace hil::config
