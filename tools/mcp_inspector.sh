#!/usr/bin/env bash
# Lists the tools of `fmlgs mcp` and calls each of them once with the inspector of the Model Context Protocol, which npx
# fetches from npm. The scene should be a copy: exports are written beside it. Ends with 1 if a tool gives no result.
# Usage: tools/mcp_inspector.sh FMLGS SCENE [TARGET]; needs Node.js and npm. TARGET is what an object is called, or 1.
set -euo pipefail
fmlgs=$1 scene=$2 target=${3:-1}
inspect() {
    npx --yes @modelcontextprotocol/inspector --cli "$fmlgs" mcp "$scene" --transport stdio "$@" 2>>"$said"
}
said=$(mktemp)
trap 'rm -f "$said"' EXIT
inspect --method tools/list >"$said.list" || { cat "$said" >&2; exit 1; }
# One line for each tool: its name, and an argument for each field that it requires.
arguments='
    const { tools } = JSON.parse(require("fs").readFileSync(process.argv[1], "utf8"));
    const value = (schema, name) => {
        if (schema.enum) return schema.enum[0];
        if (name === "target") return /^\d+$/.test(process.argv[2]) ? Number(process.argv[2]) : process.argv[2];
        if (schema.anyOf) return value(schema.anyOf[0], name);
        return { integer: schema.minimum, number: 10, array: [], string: "box" }[schema.type] ?? "box";
    };
    for (const { name, inputSchema } of tools) {
        const text = (given) => (typeof given === "string" ? given : JSON.stringify(given));
        const given = inputSchema.required.map((key) => `${key}=${text(value(inputSchema.properties[key], key))}`);
        console.log([name, ...given].join("\t"));
    }'
failed=0 count=0
while IFS=$'\t' read -r name rest; do
    given=()
    if [ -n "$rest" ]; then
        IFS=$'\t' read -ra fields <<<"$rest"
        for field in "${fields[@]}"; do given+=(--tool-arg "$field"); done
    fi
    count=$((count + 1))
    # Versions from 2 on fail where a result is an error, which is a result all the same.
    if result=$(inspect --method tools/call --tool-name "$name" "${given[@]}" </dev/null) ||
        result=$(tail -1 "$said" | grep tool_is_error); then
        echo "$name(${rest//$'\t'/, }): $(tr -s ' \n' ' ' <<<"$result" | cut -c 1-160)"
    else
        echo "$name($rest): NO RESULT"
        failed=1
    fi
done < <(node -e "$arguments" "$said.list" "$target")
rm -f "$said.list"
[ "$failed" = 0 ] || cat "$said" >&2
echo "$count tools called"
[ "$count" -gt 2 ] && exit "$failed"
