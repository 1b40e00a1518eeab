#pragma once
// The words that begin a statement of a DBC file.

#include <algorithm>
#include <array>
#include <string_view>

namespace hil::io::can {

/// True for every statement of the format, including those that the parser skips.
inline bool is_dbc_keyword(std::string_view word) noexcept {
  static constexpr std::array words = std::to_array<std::string_view>({"VERSION",
                                                                       "NS_",
                                                                       "BS_",
                                                                       "BU_",
                                                                       "BO_",
                                                                       "SG_",
                                                                       "VAL_",
                                                                       "BA_",
                                                                       "CM_",
                                                                       "VAL_TABLE_",
                                                                       "SIG_VALTYPE_",
                                                                       "SG_MUL_VAL_",
                                                                       "BA_DEF_",
                                                                       "BA_DEF_DEF_",
                                                                       "BA_DEF_REL_",
                                                                       "BA_REL_",
                                                                       "BA_SGTYPE_",
                                                                       "BO_TX_BU_",
                                                                       "EV_",
                                                                       "ENVVAR_DATA_",
                                                                       "SGTYPE_",
                                                                       "SGTYPE_VAL_",
                                                                       "SIG_GROUP_",
                                                                       "CAT_",
                                                                       "CAT_DEF_",
                                                                       "FILTER",
                                                                       "EV_DATA_",
                                                                       "BU_SG_REL_",
                                                                       "BU_EV_REL_",
                                                                       "BU_BO_REL_",
                                                                       "SIGTYPE_VALTYPE_",
                                                                       "SIG_TYPE_REF_",
                                                                       "BA_DEF_SGTYPE_",
                                                                       "BA_DEF_DEF_REL_"});
  return !word.empty() && std::find(words.begin(), words.end(), word) != words.end();
}

/// The kinds of object that comments and attributes belong to.
inline bool is_dbc_object(std::string_view word) noexcept {
  return word == "BU_" || word == "BO_" || word == "SG_" || word == "EV_";
}

}  // namespace hil::io::can
