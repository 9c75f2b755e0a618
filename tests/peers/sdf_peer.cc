// Prints the number of libsdformat errors for each file. Arguments: folders of models, --, files.
#include <iostream>
#include <string>
#include <vector>

#include <sdf/sdf.hh>

static std::vector<std::string> folders;

static std::string find(const std::string &uri) {
  const auto mark = uri.find("://");
  const std::string name = mark == std::string::npos ? uri : uri.substr(mark + 3);
  for (const auto &folder : folders)
    if (sdf::filesystem::exists(folder + "/" + name)) return folder + "/" + name;
  return "";
}

int main(int argc, char **argv) {
  int i = 1;
  for (; i < argc && std::string(argv[i]) != "--"; ++i) folders.push_back(argv[i]);
  sdf::setFindCallback(find);
  for (++i; i < argc; ++i) {
    sdf::Root root;
    std::cout << root.Load(argv[i]).size() << "\t" << argv[i] << "\n";
  }
}
