//! A real browser without a display, driven through WebDriver's plain HTTP.

use std::io::{BufRead, BufReader, Lines};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use image::RgbImage;
use serde_json::{Value, json};

/// Time that anything may take: machines of tests are slow, and draw without a GPU.
const PATIENCE: Duration = Duration::from_secs(300);
/// The key that WebDriver calls elements by.
const ELEMENT: &str = "element-6066-11e4-a52e-4f735466cecf";
/// Escape, as WebDriver writes it.
pub const ESCAPE: &str = "\u{e00c}";

/// A browser with one window; closed when dropped.
pub struct Browser {
    driver: Child,
    /// It is not to write into a closed pipe.
    _said: Lines<BufReader<ChildStdout>>,
    agent: ureq::Agent,
    session: String,
}

/// A driver, what it says, and the port at which it listens; `None` if it ended before.
fn start(driver: &Path) -> Option<(Child, Lines<BufReader<ChildStdout>>, u16)> {
    let mut driver = Command::new(driver).arg("--port=0").stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut said = BufReader::new(driver.stdout.take().unwrap()).lines();
    let port = |l: String| l.split("successfully on port ").nth(1)?.trim_end_matches('.').parse::<u16>().ok();
    let Some(port) = said.by_ref().map_while(Result::ok).find_map(port) else {
        driver.wait().unwrap();
        return None;
    };
    Some((driver, said, port))
}

impl Browser {
    /// Opens one whose pages have this size in px. Where it is not installed, this prints the line that the count of
    /// skipped tests looks for and returns `None`.
    pub fn open(width: u32, height: u32) -> Option<Self> {
        let (Some(chromium), Some(driver)) = (program("chromium"), program("chromedriver")) else {
            println!("skipped: no chromium with its chromedriver here");
            return None;
        };
        // The port that a driver chooses may be taken by another program before the driver has it; it ends then.
        let (driver, said, port) = (0..5).find_map(|_| start(&driver)).expect("a driver that listens");
        let agent = ureq::Agent::config_builder().http_status_as_error(false).proxy(None).build().new_agent();
        let mut browser = Self { driver, _said: said, agent, session: format!("http://127.0.0.1:{port}/session") };
        let arguments = [
            "--headless=new",
            "--no-sandbox",
            "--disable-dev-shm-usage",
            "--use-gl=angle",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--force-device-scale-factor=1",
            "--hide-scrollbars",
        ];
        let options = json!({
            "browserName": "chrome",
            "goog:loggingPrefs": { "browser": "ALL", "performance": "ALL" },
            "goog:chromeOptions": { "binary": chromium, "args": arguments },
        });
        let started = browser.post("", &json!({ "capabilities": { "alwaysMatch": options } }));
        browser.session += &format!("/{}", started["sessionId"].as_str().unwrap());
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        browser.post("/goog/cdp/execute", &json!({ "cmd": "Emulation.setDeviceMetricsOverride", "params": metrics }));
        Some(browser)
    }

    fn post(&self, command: &str, body: &Value) -> Value {
        let mut answer = self.agent.post(format!("{}{command}", self.session)).send(body.to_string()).unwrap();
        let text = answer.body_mut().with_config().limit(256 << 20).read_to_string().unwrap();
        let answer: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(answer["value"]["error"], Value::Null, "{command}: {}", answer["value"]["message"]);
        answer["value"].clone()
    }

    /// Opens a file by its `file:` address and waits until it is drawn.
    pub fn load(&self, page: &Path) {
        let address: String = page.to_str().unwrap().bytes().map(|b| format!("%{b:02X}")).collect();
        self.post("/url", &json!({ "url": format!("file://{}", address.replace("%2F", "/")) }));
        self.rest();
    }

    /// Waits until nothing is due to be drawn any more.
    pub fn rest(&self) {
        self.wait(
            "the picture rests",
            "return document.body.dataset.state !== 'error' || document.body.innerText",
            &json!(true),
        );
        self.wait("the picture rests", "return document.body.dataset.state", &json!("resting"));
    }

    /// Waits until a script returns this.
    pub fn wait(&self, what: &str, script: &str, wanted: &Value) {
        let start = Instant::now();
        loop {
            let found = self.run(script);
            if found == *wanted {
                return;
            }
            assert!(start.elapsed() < PATIENCE, "{what}: {found}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Value that a script returns.
    pub fn run(&self, script: &str) -> Value {
        self.post("/execute/sync", &json!({ "script": script, "args": [] }))
    }

    /// As [`Self::run`], of a script that calls its last argument.
    pub fn run_async(&self, script: &str) -> Value {
        self.post("/execute/async", &json!({ "script": script, "args": [] }))
    }

    /// Clicks the first element of a selector.
    pub fn click(&self, selector: &str) {
        let found = self.post("/element", &json!({ "using": "css selector", "value": selector }));
        self.post(&format!("/element/{}/click", found[ELEMENT].as_str().unwrap()), &json!({}));
    }

    /// Presses and releases a key.
    pub fn key(&self, key: &str) {
        let actions = json!([{ "type": "keyDown", "value": key }, { "type": "keyUp", "value": key }]);
        self.post("/actions", &json!({ "actions": [{ "type": "key", "id": "keys", "actions": actions }] }));
    }

    /// Clicks a pixel of the page.
    pub fn click_at(&self, x: u32, y: u32) {
        let actions = json!([
            { "type": "pointerMove", "x": x, "y": y, "duration": 0 },
            { "type": "pointerDown", "button": 0 },
            { "type": "pointerUp", "button": 0 },
            // Two clicks in a row are not to be a double click.
            { "type": "pause", "duration": 600 },
        ]);
        self.post("/actions", &json!({ "actions": [{ "type": "pointer", "id": "mouse", "actions": actions }] }));
    }

    /// Screenshot of the window.
    pub fn picture(&self) -> RgbImage {
        let mut answer = self.agent.get(format!("{}/screenshot", self.session)).call().unwrap();
        let text = answer.body_mut().with_config().limit(256 << 20).read_to_string().unwrap();
        let answer: Value = serde_json::from_str(&text).unwrap();
        let bytes = base64::decode(answer["value"].as_str().unwrap()).unwrap();
        image::load_from_memory(&bytes).unwrap().to_rgb8()
    }

    /// Complaints of its console, and the addresses of all requests so far.
    pub fn complaints_and_requests(&self) -> (Vec<String>, Vec<String>) {
        let log = |kind: &str| self.post("/se/log", &json!({ "type": kind }));
        let entries = log("browser");
        let complaints = entries.as_array().unwrap().iter().filter(|e| e["level"] != "INFO" && e["level"] != "DEBUG");
        let complaints = complaints.map(|e| e["message"].as_str().unwrap().to_owned()).collect();
        let events = log("performance");
        let requests = events.as_array().unwrap().iter().filter_map(|e| {
            let event: Value = serde_json::from_str(e["message"].as_str()?).ok()?;
            let asks = event["message"]["method"] == "Network.requestWillBeSent";
            asks.then(|| event["message"]["params"]["request"]["url"].as_str().map(str::to_owned))?
        });
        (complaints, requests.collect())
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Its own end closes the browser, too; a kill would leave it behind.
        let _ = self.agent.delete(&self.session).call();
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

fn program(name: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders).map(|folder| folder.join(name)).find(|path| path.is_file())
}
