#include <array>

#include <gmock/gmock.h>

#include "api/cli/verbs/word_hint.hpp"
#include "api/cli/words/completion.hpp"
#include "api/cli/words/man_page.hpp"
#include "api/cli/words/overview.hpp"
#include "api/cli/words/short_form.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Syntax small_program() {
  const Syntax::Option help{.names = {"-h", "--help"}, .value = "", .text = "help", .variable = ""};
  const Syntax::Option host{
      .names = {"--host"}, .value = "TEXT", .text = "which", .variable = "PLCHOST_HOST"};
  const Syntax::Option count{.names = {"--count"}, .value = "UINT", .text = "how often", .variable = ""};
  const Syntax event{.name = "event",
                     .text = "Post it",
                     .options = {help, count},
                     .arguments = {{.form = "INSTANCE/EVENT", .text = "which one", .required = true}},
                     .words = {}};
  const Syntax post{.name = "post", .text = "Post", .options = {help}, .arguments = {}, .words = {event}};
  const Syntax list{.name = "list", .text = "List", .options = {help}, .arguments = {}, .words = {}};
  return {.name = "small",
          .text = "small: does little",
          .options = {help, host},
          .arguments = {},
          .words = {list, post}};
}

std::vector<std::string> offered(const std::vector<std::string>& words) {
  std::vector<std::string> names;
  for (const Candidate& one : complete(small_program(), words).candidates) names.push_back(one.word);
  return names;
}

std::string value_at(const std::vector<std::string>& words) {
  return complete(small_program(), words).value;
}

TEST(Completion, OffersTheWordsThatMayStandThere) {
  EXPECT_THAT(offered({""}), ElementsAre("list", "post"));
  EXPECT_THAT(offered({"p"}), ElementsAre("post"));
  EXPECT_THAT(offered({"post", ""}), ElementsAre("event"));
  EXPECT_THAT(offered({"x"}), IsEmpty());
}

TEST(Completion, OffersTheOptionsOfAllWordsSoFar) {
  EXPECT_THAT(offered({"--h"}), ElementsAre("--help", "--host"));
  EXPECT_THAT(offered({"post", "event", "--c"}), ElementsAre("--count"));
  EXPECT_THAT(offered({"post", "--c"}), IsEmpty()) << "it is not known there yet";
}

TEST(Completion, SaysWhichKindOfValueIsWanted) {
  EXPECT_EQ(value_at({"post", "event", ""}), "INSTANCE/EVENT");
  EXPECT_EQ(value_at({"post", "event", "--count", "3", ""}), "INSTANCE/EVENT") << "an option is no argument";
  EXPECT_EQ(value_at({"post", "event", "a/b", ""}), "") << "there is only one";
  EXPECT_EQ(value_at({"--host", ""}), "--host");
  EXPECT_EQ(value_at({"post", "event", "--count", ""}), "--count");
}

TEST(Completion, KeepsTheOptionsThatSayWhereToAsk) {
  const std::vector<std::string> words{"--host", "north", "post", "event", "--count", "2", ""};
  EXPECT_THAT(complete(small_program(), words).options, ElementsAre("--host", "north"));
  EXPECT_THAT(complete(small_program(), std::vector<std::string>{"--host", "n"}).options, IsEmpty());
  const std::vector<std::string> joined{"--host=north", "post", "event", ""};
  EXPECT_THAT(complete(small_program(), joined).options, ElementsAre("--host=north"));
}

TEST(Completion, OfNothingIsThatOfAnEmptyWord) {
  EXPECT_EQ(complete(small_program(), {}).candidates.size(), 2U);
}

TEST(ShortForm, NeedsNoNounWhereThereIsOneOnly) {
  using Words = std::vector<std::string>;
  const auto whole = [](const Words& words) { return with_noun(small_program(), words); };
  const Words in_full{"--host", "post", "post", "event", "a/b", "c/d"};
  EXPECT_EQ(whole({"--host", "post", "post", "a/b", "c/d"}), in_full) << "the value of an option is no verb";
  EXPECT_EQ(whole(in_full), in_full);
  EXPECT_EQ(whole({"post", "--count", "3", "a/b"}), (Words{"post", "event", "--count", "3", "a/b"}));
  for (const Words& kept :
       {Words{}, Words{"post"}, Words{"post", "evnt", "a/b"}, Words{"list", "a"}, Words{"x"}})
    EXPECT_EQ(whole(kept), kept);
}

TEST(Overview, ListsTheCommandsWithWhatTheyWant) {
  const std::string all = overview(small_program(), "small");
  EXPECT_THAT(all, HasSubstr("  post event INSTANCE/EVENT  Post it\n"));
  EXPECT_THAT(all, HasSubstr("  list                       List\n"));
  EXPECT_THAT(overview(*small_program().word("post"), "small post"),
              HasSubstr("small post ...\n  event INSTANCE/EVENT  Post it\n"));
}

TEST(ManPage, HasAllThatTheHelpHas) {
  const std::string page = man_page(small_program(), "0 done");
  for (const char* part : {".TH SMALL 1", "does little", "\\-\\-host", "\\fITEXT\\fR", "post event",
                           "INSTANCE/EVENT", "how often", "0 done", "PLCHOST_HOST"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
}

TEST(ManPage, TakesNoTextForARequest) {
  Syntax program = small_program();
  program.options[1].text = ".so /etc/passwd";
  EXPECT_THAT(man_page(program, ""), HasSubstr("\\&.so"));
}

std::string hinted(const std::vector<std::string>& words) {
  return word_hint(small_program(), words);
}

TEST(WordHint, NamesTheWordsThatMayStandThere) {
  const std::string unknown = "small: unknown word 'line1'; known here: event\n";
  EXPECT_EQ(hinted({"post", "line1"}), unknown);
  EXPECT_EQ(hinted({"--host", "cell", "post", "line1"}), unknown);
  EXPECT_EQ(hinted({"--host=cell", "post", "line1"}), unknown);
  EXPECT_EQ(hinted({"post", "--host", "cell", "line1", "--nonsense"}), unknown);
  EXPECT_EQ(hinted({"--host", "cell", "post"}), "small: 'small post' needs one more word: event\n");
  EXPECT_EQ(hinted({"--host", "cell"}), "small: 'small' needs one more word: list, post\n");
}

TEST(WordHint, SaysNothingOfWordsThatAreRight) {
  EXPECT_EQ(hinted({"post", "event", "line1"}), "");
  EXPECT_EQ(hinted({"list"}), "");
  EXPECT_EQ(hinted({"--nonsense", "line1"}), "") << "the option is the mistake";
}

}  // namespace
}  // namespace plchost
