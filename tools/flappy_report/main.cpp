// flappy-report: shows results as one page that opens anywhere, and writes their figures for a paper.
#include <cstdio>
#include <system_error>

#include "io/files.hpp"
#include "io/program.hpp"
#include "io/run_program.hpp"
#include "view/compose.hpp"

namespace flappy::view {
namespace {

namespace fs = std::filesystem;

struct Request {
  std::vector<fs::path> paths;
  fs::path out = "report.html", svg, pdf;
  std::string title;
  std::vector<double> goal_m;
  FlightOptions flights;
  bool open = false;
};

/// Writes the figures of all sections; where two have the same name, the later one gets its section's number.
std::vector<fs::path> draw_all(const std::vector<Section>& sections, const fs::path& folder, Paper paper) {
  io::make_folder(folder);
  std::vector<std::string> taken;
  std::vector<fs::path> files;
  for (std::size_t k = 0; k < sections.size(); ++k)
    for (Figure f : sections[k].figures()) {
      if (std::ranges::find(taken, f.id) != taken.end()) f.id += "_" + std::to_string(k + 1);
      taken.push_back(f.id);
      draw_on_paper(folder, f, paper);
      files.push_back(folder / f.id);
    }
  return files;
}

/// Whether a page was shown to the user.
bool opened(const std::filesystem::path& page) {
  try {
    return io::run({"xdg-open", page.string()}).exit_code == 0;
  } catch (const std::system_error&) {
    return false;
  }
}

Json report(Request request) {
  if (!request.goal_m.empty() && request.goal_m.size() != 3)
    throw io::InputError("--goal: has " + std::to_string(request.goal_m.size()) + " numbers; accepted: X,Y,Z in m");
  if (!request.goal_m.empty()) request.flights.goal_m = {request.goal_m[0], request.goal_m[1], request.goal_m[2]};
  io::check_output(request.out);
  Packing packing;
  const std::vector<Section> sections = composed(request.paths, request.flights, packing);
  const std::string title = request.title.empty() ? sections.front().title() : request.title;
  const std::string page = page_text(title, sections, packing);
  io::write_atomically(request.out, page);
  std::printf("%s: %.2f MB, opens in any browser\n", request.out.c_str(), static_cast<double>(page.size()) / 1e6);
  std::size_t figures = 0;
  for (const auto& [folder, paper] : {std::pair{request.svg, Paper::svg}, {request.pdf, Paper::pdf}}) {
    if (folder.empty()) continue;
    figures = draw_all(sections, folder, paper).size();
    std::printf("%s: %zu figures\n", folder.c_str(), figures);
  }
  if (request.open && !opened(request.out)) std::printf("--open: xdg-open failed; open the page yourself\n");
  Json list = Json::array();
  for (const Section& s : sections)
    list.push_back({{"kind", s.kind()}, {"title", s.title()}, {"figures", s.figures().size()}});
  return {{"out", request.out.string()}, {"bytes", page.size()}, {"sections", list}, {"commit", io::commit()}};
}

}  // namespace
}  // namespace flappy::view

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-report", "Shows results as one page that opens anywhere.", {});
  const io::Command& app = program.app();
  view::Request r;
  app.option("path", r.paths,
             "flight logs, run folders, results of flappy-eval, flappy-gap diagnose and plan, flappy-identify forces, "
             "flappy-blind score, folders of flappy-design")
      .required();
  app.option("--out", r.out, "the page").shows_default();
  app.option("--title", r.title, "of the page; its first section's unless told");
  app.option("--goal", r.goal_m, "where the flights were to go: X,Y,Z in W, m").separated_by(',');
  app.option("--vehicle", r.flights.vehicle, "vehicle file of flights whose folder has none");
  app.option("--svg", r.svg, "folder for all figures as SVG");
  app.option("--pdf", r.pdf, "folder for all figures as PDF, a column wide");
  app.flag("--open", r.open, "open the page");
  return program.run(argc, argv, [&] { program.write_json(view::report(r)); });
}
