#!/usr/bin/env bash
# Compares the outputs of a project with what it makes, and leaves a page of each difference.
# Usage: check.sh PROJECT-FOLDER PICTURES-FOLDER
set -euo pipefail
project=$1
mkdir -p "$2"
pictures=$(cd "$2" && pwd)
cd "$project"
if plotplan build --check; then
    exit 0
fi
# The outputs as they should be, beside those of the commit.
plotplan build --quiet || true
git diff --name-only --relative -- . ':!plotplan.lock' ':!plotplan.toml' | while read -r file; do
    old=$(mktemp -d)/$(basename "$file")
    git show "HEAD:./$file" > "$old"
    echo "== $file"
    plotplan diff "$old" "$file" --output "$pictures/${file//\//-}.html" || true
done
exit 1
