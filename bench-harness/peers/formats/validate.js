// Counts what Khronos' validator finds in two files: node validate.js BEFORE AFTER. Prints the codes that are new or more frequent in the second.
const fs = require('fs');
const path = require('path');
const validator = require('gltf-validator');

async function issues(file) {
  const beside = (uri) => new Uint8Array(fs.readFileSync(path.join(path.dirname(file), decodeURIComponent(uri))));
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
    maxIssues: 0,
    externalResourceFunction: async (uri) => beside(uri),
  });
  const counts = {};
  for (const { code } of report.issues.messages) counts[code] = (counts[code] ?? 0) + 1;
  return counts;
}

(async () => {
  const [before, after] = await Promise.all(process.argv.slice(2, 4).map(issues));
  const fresh = Object.keys(after).filter((code) => after[code] > (before[code] ?? 0));
  console.log(JSON.stringify({ before: Object.values(before).reduce((a, b) => a + b, 0), fresh }));
})();
