# Instructions and model cycles a boulder, from what decode.cpp printed and the profile of its run (make bench-decode).
NR == FNR {
  split($0, word, " ")
  if (word[1] == "boulders") { in_map = word[2]; in_window = word[4] }
  next
}
$1 == "function" && $3 ~ /OrbitalMap6window/ {
  printf "window: %.1f instructions, %.1f cycles a boulder (%d boulders)\n", $5 / in_window, $6 / in_window, in_window
}
$1 == "function" && $3 ~ /MapValidation4step/ {
  printf "validation: %.1f instructions, %.1f cycles a boulder\n", $5 / in_map, $6 / in_map
}
