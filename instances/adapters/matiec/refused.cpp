#include "instances/adapters/matiec/refused.hpp"

#include <algorithm>
#include <array>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"

namespace plchost::matiec {

namespace {

using iec::Token;

// Sorted: macros of glibc and of iec2c's library that stand for values. `cc -dM -E` tells them. iec2c writes
// each name in upper case. So a variable of such a name becomes a number in the C.
constexpr std::array<std::string_view, 212> kMacros{
    "AIO_PRIO_DELTA_MAX",
    "BC_BASE_MAX",
    "BC_DIM_MAX",
    "BC_SCALE_MAX",
    "BC_STRING_MAX",
    "BIG_ENDIAN",
    "BUFSIZ",
    "BYTE_ORDER",
    "CHARCLASS_NAME_MAX",
    "CHAR_BIT",
    "CHAR_MAX",
    "CHAR_MIN",
    "CLOCKS_PER_SEC",
    "CLOCK_BOOTTIME",
    "CLOCK_BOOTTIME_ALARM",
    "CLOCK_MONOTONIC",
    "CLOCK_MONOTONIC_COARSE",
    "CLOCK_MONOTONIC_RAW",
    "CLOCK_PROCESS_CPUTIME_ID",
    "CLOCK_REALTIME",
    "CLOCK_REALTIME_ALARM",
    "CLOCK_REALTIME_COARSE",
    "CLOCK_TAI",
    "CLOCK_THREAD_CPUTIME_ID",
    "COLL_WEIGHTS_MAX",
    "DBL_DECIMAL_DIG",
    "DBL_DIG",
    "DBL_EPSILON",
    "DBL_HAS_SUBNORM",
    "DBL_MANT_DIG",
    "DBL_MAX",
    "DBL_MAX_10_EXP",
    "DBL_MAX_EXP",
    "DBL_MIN",
    "DBL_MIN_10_EXP",
    "DBL_MIN_EXP",
    "DBL_TRUE_MIN",
    "DECIMAL_DIG",
    "DELAYTIMER_MAX",
    "EN_ENO",
    "EOF",
    "EPOCH_YEAR",
    "EXIT_FAILURE",
    "EXIT_SUCCESS",
    "EXPR_NEST_MAX",
    "FD_SETSIZE",
    "FILENAME_MAX",
    "FLT_DECIMAL_DIG",
    "FLT_DIG",
    "FLT_EPSILON",
    "FLT_EVAL_METHOD",
    "FLT_HAS_SUBNORM",
    "FLT_MANT_DIG",
    "FLT_MAX",
    "FLT_MAX_10_EXP",
    "FLT_MAX_EXP",
    "FLT_MIN",
    "FLT_MIN_10_EXP",
    "FLT_MIN_EXP",
    "FLT_RADIX",
    "FLT_ROUNDS",
    "FLT_TRUE_MIN",
    "FOPEN_MAX",
    "FP_ILOGB0",
    "FP_ILOGBNAN",
    "FP_INFINITE",
    "FP_NAN",
    "FP_NORMAL",
    "FP_SUBNORMAL",
    "FP_ZERO",
    "HOST_NAME_MAX",
    "HUGE_VAL",
    "HUGE_VALF",
    "HUGE_VALL",
    "INFINITY",
    "INT16_MAX",
    "INT16_MIN",
    "INT32_MAX",
    "INT32_MIN",
    "INT64_MAX",
    "INT64_MIN",
    "INT8_MAX",
    "INT8_MIN",
    "INTMAX_MAX",
    "INTMAX_MIN",
    "INTPTR_MAX",
    "INTPTR_MIN",
    "INT_FAST16_MAX",
    "INT_FAST16_MIN",
    "INT_FAST32_MAX",
    "INT_FAST32_MIN",
    "INT_FAST64_MAX",
    "INT_FAST64_MIN",
    "INT_FAST8_MAX",
    "INT_FAST8_MIN",
    "INT_LEAST16_MAX",
    "INT_LEAST16_MIN",
    "INT_LEAST32_MAX",
    "INT_LEAST32_MIN",
    "INT_LEAST64_MAX",
    "INT_LEAST64_MIN",
    "INT_LEAST8_MAX",
    "INT_LEAST8_MIN",
    "INT_MAX",
    "INT_MIN",
    "LDBL_DECIMAL_DIG",
    "LDBL_DIG",
    "LDBL_EPSILON",
    "LDBL_HAS_SUBNORM",
    "LDBL_MANT_DIG",
    "LDBL_MAX",
    "LDBL_MAX_10_EXP",
    "LDBL_MAX_EXP",
    "LDBL_MIN",
    "LDBL_MIN_10_EXP",
    "LDBL_MIN_EXP",
    "LDBL_TRUE_MIN",
    "LINE_MAX",
    "LITTLE_ENDIAN",
    "LLONG_MAX",
    "LLONG_MIN",
    "LOGIN_NAME_MAX",
    "LONG_MAX",
    "LONG_MIN",
    "MATH_ERREXCEPT",
    "MATH_ERRNO",
    "MAX_CANON",
    "MAX_INPUT",
    "MB_CUR_MAX",
    "MB_LEN_MAX",
    "MQ_PRIO_MAX",
    "M_1_PI",
    "M_2_PI",
    "M_2_SQRTPI",
    "M_E",
    "M_LN10",
    "M_LN2",
    "M_LOG10E",
    "M_LOG2E",
    "M_PI",
    "M_PI_2",
    "M_PI_4",
    "M_SQRT1_2",
    "M_SQRT2",
    "NAME_MAX",
    "NAN",
    "NFDBITS",
    "NGROUPS_MAX",
    "NULL",
    "PATH_MAX",
    "PDP_ENDIAN",
    "PIPE_BUF",
    "PTHREAD_DESTRUCTOR_ITERATIONS",
    "PTHREAD_KEYS_MAX",
    "PTHREAD_STACK_MIN",
    "PTRDIFF_MAX",
    "PTRDIFF_MIN",
    "RAND_MAX",
    "RE_DUP_MAX",
    "RTSIG_MAX",
    "SCHAR_MAX",
    "SCHAR_MIN",
    "SECONDS_PER_DAY",
    "SECONDS_PER_HOUR",
    "SECONDS_PER_MINUTE",
    "SEEK_CUR",
    "SEEK_END",
    "SEEK_SET",
    "SEM_VALUE_MAX",
    "SHRT_MAX",
    "SHRT_MIN",
    "SIG_ATOMIC_MAX",
    "SIG_ATOMIC_MIN",
    "SIZE_MAX",
    "SSIZE_MAX",
    "STR_MAX_LEN",
    "TIMER_ABSTIME",
    "TIME_UTC",
    "TMP_MAX",
    "TTY_NAME_MAX",
    "UCHAR_MAX",
    "UINT16_MAX",
    "UINT32_MAX",
    "UINT64_MAX",
    "UINT8_MAX",
    "UINTMAX_MAX",
    "UINTPTR_MAX",
    "UINT_FAST16_MAX",
    "UINT_FAST32_MAX",
    "UINT_FAST64_MAX",
    "UINT_FAST8_MAX",
    "UINT_LEAST16_MAX",
    "UINT_LEAST32_MAX",
    "UINT_LEAST64_MAX",
    "UINT_LEAST8_MAX",
    "UINT_MAX",
    "ULLONG_MAX",
    "ULONG_MAX",
    "USHRT_MAX",
    "WCHAR_MAX",
    "WCHAR_MIN",
    "WCONTINUED",
    "WEXITED",
    "WINT_MAX",
    "WINT_MIN",
    "WNOHANG",
    "WNOWAIT",
    "WSTOPPED",
    "WUNTRACED",
    "XATTR_LIST_MAX",
    "XATTR_NAME_MAX",
    "XATTR_SIZE_MAX",
};

bool is_macro(std::string_view name) {
  return std::ranges::binary_search(kMacros, std::string_view(iec::folded(name)));
}

class NameCheck {
 public:
  explicit NameCheck(iec::SourceProblems& problems) : problems_(problems) {}

  void check(const std::string& name, const iec::SourcePlace& place) {
    if (!is_macro(name)) return;
    problems_.push_back(
        {place, fmt::format("'{}' is a macro of the C library, and iec2c makes C of the program; "
                            "choose another name",
                            name)});
  }
  void check(const std::vector<iec::Variable>& variables) {
    for (const iec::Variable& variable : variables) check(variable.name, variable.place);
  }
  // POINT : STRUCT NAN : REAL ; END_STRUCT
  void check(const iec::DeclaredType& type) {
    std::istringstream words(type.definition);
    std::string before;
    for (std::string word; words >> word; before = std::exchange(word, "")) {
      if (word == ":") check(before, type.place);
    }
  }

 private:
  iec::SourceProblems& problems_;
};

// iec2c takes such a word for the configuration everywhere.
void refuse_name_of_configuration(const iec::Project& project, const iec::Configuration& configuration,
                                  iec::SourceProblems& problems) {
  const auto check = [&](const std::string& name, const iec::SourcePlace& place) {
    if (configuration.name.empty() || iec::folded(name) != iec::folded(configuration.name)) return;
    problems.push_back({place, fmt::format("'{}' is also the name of the CONFIGURATION, which iec2c does not "
                                           "tell apart; choose another one",
                                           name)});
  };
  const auto check_all = [&](const std::vector<iec::Variable>& variables) {
    for (const iec::Variable& variable : variables) check(variable.name, variable.place);
  };
  for (const iec::Pou& pou : project.pous) {
    check(pou.name, pou.name_place);
    check_all(pou.variables);
  }
  check_all(configuration.globals);
  for (const iec::Resource& resource : configuration.resources) check_all(resource.globals);
}

}  // namespace

iec::SourceProblems refused_names(const iec::Project& project) {
  iec::SourceProblems problems;
  NameCheck names(problems);
  for (const iec::Pou& pou : project.pous) {
    names.check(pou.name, pou.name_place);
    names.check(pou.variables);
  }
  for (const iec::DeclaredType& type : project.types) names.check(type);
  for (const iec::Configuration& configuration : project.configurations) {
    refuse_name_of_configuration(project, configuration, problems);
    names.check(configuration.name, configuration.place);
    names.check(configuration.globals);
    for (const iec::Resource& resource : configuration.resources) {
      names.check(resource.name, resource.place);
      names.check(resource.globals);
      for (const iec::Task& task : resource.tasks) names.check(task.name, task.place);
      for (const iec::Program& program : resource.programs) names.check(program.name, program.place);
      if (project.pou(resource.name) == nullptr) continue;
      problems.push_back({resource.place, fmt::format("RESOURCE {}: a POU has this name; choose another one",
                                                      resource.name)});
    }
  }
  return problems;
}

iec::SourceProblems refused_pous(const iec::Project& project, std::span<const iec::Source> sources) {
  constexpr std::array<std::string_view, 3> kKinds{"PROGRAM", "FUNCTION_BLOCK", "FUNCTION"};
  iec::SourceProblems problems;
  const auto refuse_enumerations = [&](const std::vector<iec::Variable>& variables) {
    for (const iec::Variable& variable : variables) {
      if (!variable.type.starts_with('(')) continue;
      problems.push_back(
          {variable.place,
           fmt::format("'{}' has an enumeration of its own, which iec2c cannot translate; give "
                       "that a name in TYPE ... END_TYPE",
                       variable.name)});
    }
  };
  for (const iec::Configuration& configuration : project.configurations) {
    refuse_enumerations(configuration.globals);
    for (const iec::Resource& resource : configuration.resources) refuse_enumerations(resource.globals);
  }
  for (const iec::Pou& pou : project.pous) {
    refuse_enumerations(pou.variables);
    if (!pou.variables.empty()) continue;
    problems.push_back(
        {pou.name_place, fmt::format("{} {} has no variables, and iec2c cannot translate it; declare one",
                                     kKinds.at(std::to_underlying(pou.kind)), pou.name)});
  }
  for (const iec::Source& source : sources) {
    const iec::Tokens tokens = iec::tokens_of(source.text, source.file);
    const Token* before = nullptr;
    for (const Token& token : tokens.all) {
      if (before != nullptr && before->is("END_VAR") && token.is(";")) {
        problems.push_back(
            {token.place, "iec2c cannot translate a body that begins with ';'; write a statement there"});
      }
      if (token.kind != Token::Kind::pragma) before = &token;
    }
  }
  return problems;
}

iec::SourceProblems refused_words(std::span<const iec::Source> sources) {
  iec::SourceProblems problems;
  const auto is_wide = [](const Token& token) {
    return token.is("WSTRING") || (token.kind == Token::Kind::text && token.text.starts_with('"')) ||
           (token.kind == Token::Kind::literal && iec::folded(token.text).starts_with("WSTRING#"));
  };
  for (const iec::Source& source : sources) {
    const iec::Tokens tokens = iec::tokens_of(source.text, source.file);
    const auto wide = std::ranges::find_if(tokens.all, is_wide);
    if (wide != tokens.all.end()) {
      problems.push_back({wide->place,
                          "WSTRING: iec2c cannot translate it, nor a text between \"; use STRING, "
                          "and texts between '"});
    }
  }
  return problems;
}

}  // namespace plchost::matiec
