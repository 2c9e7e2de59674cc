// Draws two files in Chromium, without its window and without a graphics card, and compares the pictures:
// node render.js CHROMIUM BEFORE AFTER [FOLDER FOR PICTURES]. Prints the figures of scene.mjs as JSON; fails unless all was loaded and drawn.
const { spawn } = require('child_process');
const fs = require('fs');
const http = require('http');
const os = require('os');
const path = require('path');

const SECONDS = 300;
const FLAGS = [
  '--headless=new',
  '--use-gl=angle',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  '--force-color-profile=srgb',
  '--no-sandbox', // It opens our page and nothing else, perhaps as root in a container, where there is no sandbox.
  '--no-first-run',
  '--disable-extensions',
  '--disable-background-networking',
  '--remote-debugging-pipe', // Keeps it open until it is ended.
];
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.wasm': 'application/wasm' };

// Where an address lies: a file of ours or of a package, or one of the models, or what lies beside it.
// Signing writes no textures, so those of the signed model are the original's.
function fileOf(address, before, after) {
  const [folder, ...rest] = decodeURIComponent(new URL(address, 'http://localhost').pathname).slice(1).split('/');
  const beside = (model) => path.join(path.dirname(model), ...rest);
  if (folder === 'before') return beside(before);
  if (folder === 'after') return fs.existsSync(beside(after)) ? beside(after) : beside(before);
  return path.join(__dirname, folder, ...rest);
}

// Answers with files, and gives what the page sends back to `report`.
function serve(before, after, report) {
  return http.createServer((request, response) => {
    if (request.method === 'POST') {
      const chunks = [];
      request.on('data', (chunk) => chunks.push(chunk));
      request.on('end', () => report(JSON.parse(Buffer.concat(chunks))));
      return;
    }
    const file = fileOf(request.url, before, after);
    fs.readFile(file, (error, bytes) => {
      response.writeHead(error ? 404 : 200, { 'Content-Type': TYPES[path.extname(file)] ?? 'application/octet-stream' });
      response.end(error ? '' : bytes);
    });
  });
}

// Opens our page, and waits for what it reports.
function drawn(chromium, before, after) {
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), 'render-'));
  let browser, server, timer;
  const report = new Promise((resolve, reject) => {
    server = serve(before, after, resolve);
    server.listen(0, '127.0.0.1', () => {
      const names = [before, after].map((model) => encodeURIComponent(path.basename(model)));
      const page = `http://127.0.0.1:${server.address().port}/scene.html?before=${names[0]}&after=${names[1]}`;
      browser = spawn(chromium, [...FLAGS, `--user-data-dir=${profile}`, page], {
        stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'],
      });
      browser.on('error', reject);
      browser.on('exit', (code) => reject(new Error(`Chromium ended (${code}) before it had drawn`)));
    });
    timer = setTimeout(() => reject(new Error(`nothing was drawn in ${SECONDS} s`)), 1000 * SECONDS);
  });
  return report.finally(async () => {
    clearTimeout(timer);
    server.close();
    server.closeAllConnections();
    await ended(browser);
    await fs.promises.rm(profile, { recursive: true, force: true, maxRetries: 20 }); // What it started may still be ending.
  });
}

// Ends a program, and waits until it has.
function ended(program) {
  if (!program?.pid || program.exitCode !== null) return;
  return new Promise((resolve) => {
    program.removeAllListeners('exit').on('exit', resolve);
    program.kill();
  });
}

(async () => {
  const [chromium, before, after, folder] = process.argv.slice(2);
  const { error, pictures, ...figures } = await drawn(chromium, path.resolve(before), path.resolve(after));
  if (error) throw new Error(error);
  if (folder) {
    fs.mkdirSync(folder, { recursive: true });
    for (const [name, address] of Object.entries(pictures)) {
      fs.writeFileSync(path.join(folder, `${name}.png`), Buffer.from(address.split(',')[1], 'base64'));
    }
  }
  console.log(JSON.stringify(figures));
})().catch((error) => {
  console.error(error.message);
  process.exit(1);
});
