// That text of others stays text, and that a page holds all it needs.
#include "view/page.hpp"

#include <gtest/gtest.h>

#include "view/page_files.hpp"

namespace flappy::view {
namespace {

const std::string kAttack = "</script><script>alert(1)</script><!--";

std::size_t count(const std::string& text, const std::string& of) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(of, at)) != std::string::npos; at += of.size()) ++n;
  return n;
}

TEST(Page, KeepsTextOfOthersText) {
  Section section("flight", kAttack, kAttack);
  section.say(kAttack);
  section.add(table(kAttack, {kAttack}, Json::array({Json::array({kAttack})})));
  const std::string page = page_text(kAttack, {section}, {});
  const std::string honest = page_text("", {Section("flight", "", "")}, {});
  EXPECT_EQ(count(page, "<script"), count(honest, "<script"));
  EXPECT_EQ(count(page, "</script"), count(page, "<script"));
  EXPECT_EQ(count(page, "<!--"), count(honest, "<!--"));
  EXPECT_EQ(count(page, "alert(1)"), 8u);  // the page's title in two places, and six texts
}

TEST(Page, HoldsJsonThatReadsBack) {
  const Json json = {{"name", kAttack + "&amp; \"quoted\" \u2028"}, {"x", 0.1}};
  const std::string text = json_in_html(json);
  EXPECT_EQ(text.find_first_of("<>&"), std::string::npos);
  EXPECT_EQ(Json::parse(text), json);
}

TEST(Page, NeedsNothingElse) {
  const std::string page = page_text("t", {Section("flight", "", "")}, {});
  EXPECT_EQ(count(page, " src="), 0u);
  EXPECT_EQ(count(page, "<link"), 0u);
  EXPECT_NE(page.find("default-src 'none'"), std::string::npos);
}

TEST(Modules, AreJoinedBehindWhatTheyImport) {
  const std::string joined = "\n" + joined_modules();
  EXPECT_EQ(count(joined, "\nimport "), 0u);
  EXPECT_EQ(count(joined, "\nexport "), 0u);
  const std::size_t column = joined.find("\nfunction unpackedColumn("), flight = joined.find("\nclass Flight "),
                    player = joined.find("\nclass Player "), entry = joined.find("\ndrawReport();");
  EXPECT_LT(column, flight);
  EXPECT_LT(flight, player);
  EXPECT_LT(player, entry);
  ASSERT_NE(entry, std::string::npos);
  std::size_t modules = 0;
  for (const auto& [name, text] : kPageFiles)
    if (name.ends_with(".js") && !name.ends_with(".min.js")) {
      ++modules;
      // each once: by its first line
      EXPECT_EQ(count(joined, "\n" + std::string(text.substr(0, text.find('\n'))) + "\n"), 1u) << name;
    }
  EXPECT_GE(modules, 10u);
}

}  // namespace
}  // namespace flappy::view
